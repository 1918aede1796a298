#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "light_file.h"
#include "output_check.h"
#include "picture_options.h"
#include "rebounce/demo/image_file.h"
#include "rebounce/demo/picture.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/runtime/engine.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"
#include "rebounce/transfer/transfer_file.h"

namespace rebounce::cli {
namespace {

struct RenderOptions {
  std::string file, lights, camera, size = "1280x720", show = "radiosity", output;
  std::optional<float> exposure;
};

Show parse_show(const std::string& show) {
  if (show == "direct") return Show::kDirect;
  if (show == "indirect") return Show::kIndirect;
  if (show == "patches") return Show::kPatches;
  if (show == "error") return Show::kError;
  return Show::kRadiosity;
}

/// |H - reference| of each patch, as a part of the reference's root mean square.
std::vector<float> patch_errors(const Engine& engine) {
  const TransferData& data = engine.data();
  const ReferenceSolver solver(data.exchange, data.patches);
  const std::vector<Float3> truth = solver.indirect_irradiance(engine.initial_exitance());
  double total_area = 0;
  for (const float area : data.patches.area) total_area += area;
  const double rms = area_norm(truth, data.patches.area) / std::sqrt(total_area);
  std::vector<float> error(truth.size(), 0.0F);
  for (std::size_t i = 0; i < truth.size() && rms > 0; ++i) {
    double sum = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      const double d = static_cast<double>(engine.indirect_irradiance()[i][c]) - truth[i][c];
      sum += d * d;
    }
    error[i] = static_cast<float>(std::sqrt(sum) / rms);
  }
  return error;
}

void run(const RenderOptions& chosen, const CommonOptions& options) {
  PictureSettings settings;
  std::tie(settings.width, settings.height) = parse_size(chosen.size);
  settings.show = parse_show(chosen.show);
  settings.exposure = chosen.exposure;
  check_can_write(chosen.output);
  const auto data = std::make_shared<const TransferData>(load_transfer_file(chosen.file));
  const bool needs_light = settings.show != Show::kPatches;
  const LightSetup setup = needs_light ? choose_lights(chosen.lights, *data) : LightSetup{};

  Engine engine(data);
  engine.relight(setup.lights, setup.sky);
  settings.camera = choose_camera(chosen.camera, engine);
  const std::vector<Float3> emitted_irradiance = irradiance_from_emitters(*data);
  std::vector<float> error;
  if (settings.show == Show::kError) error = patch_errors(engine);

  PictureLight light;
  light.lights = setup.lights;
  light.sky = setup.sky;
  light.indirect_irradiance = engine.indirect_irradiance();
  light.emitted_irradiance = emitted_irradiance;
  light.error = error;
  const Picture picture = render_picture(*data, engine.tracer(), light, settings);
  write_png(chosen.output, tone_map(picture));

  nlohmann::json summary = {{"width", picture.width},
                            {"height", picture.height},
                            {"show", chosen.show},
                            {"exposure", picture.exposure}};
  if (!error.empty()) summary["error_max"] = *std::ranges::max_element(error);
  if (options.json) {
    fmt::print("{}\n", summary.dump(2));
  } else if (!options.quiet) {
    fmt::print("{}: {}x{}, exposure {:+.2f} EV\n", chosen.output, picture.width, picture.height,
               picture.exposure);
  }
}

}  // namespace

void add_render_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<RenderOptions>();
  CLI::App* command =
      app.add_subcommand("render", "Draw a picture of a relit scene, without a window");
  command->add_option("file", chosen->file, "Transfer file")->required();
  command->add_option("--lights", chosen->lights,
                      "Lights: .json, or a .glb that has some; by default those of the scene");
  command->add_option(
      "--camera", chosen->camera,
      "Name or number of a camera of the scene, or px,py,pz,tx,ty,tz[,degrees] in metres");
  command->add_option("--size", chosen->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
  command
      ->add_option("--show", chosen->show,
                   "direct, indirect (bounced light only), radiosity (both), patches, or error "
                   "(of the indirect irradiance against the reference solution)")
      ->check(CLI::IsMember({"direct", "indirect", "radiosity", "patches", "error"}))
      ->capture_default_str();
  command->add_option("--exposure", chosen->exposure, "Stops; by default found from the picture");
  command->add_option("-o,--output", chosen->output, "Image to write (.png)")
      ->required()
      ->check([](const std::string& path) {
        return std::filesystem::path(path).extension() == ".png" ? "" : "must end in .png";
      });
  command->callback([chosen, &options] { run(*chosen, options); });
}

}  // namespace rebounce::cli

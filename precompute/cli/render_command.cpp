#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "precompute/cli/chosen_lights.h"
#include "precompute/cli/commands.h"
#include "precompute/cli/frame_cost.h"
#include "precompute/cli/output_check.h"
#include "precompute/cli/picture_options.h"
#include "precompute/lights/reference_solution.h"
#include "rebounce/error.h"
#include "runtime/demo/image/image_file.h"
#include "runtime/demo/picture/key_light.h"
#include "runtime/demo/picture/picture.h"
#include "runtime/demo/shading/patch_errors.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::cli {
namespace {

struct RenderOptions {
  std::string file, lights, camera, size = "1280x720", show = "radiosity", output;
  std::optional<float> exposure;
  bool key_light = false;
};

/// The error of each patch, against a solution in double precision.
std::vector<float> errors_of(const Engine& engine) {
  const TransferData& data = engine.data();
  const ReferenceSolver solver(data);
  return patch_errors(engine.indirect_irradiance(),
                      solver.indirect_irradiance(engine.initial_exitance()), data.patches.area);
}

/// What is said of a picture.
struct DrawnFrame {
  const Picture& picture;
  const ChosenCamera& camera;
  FrameTimes times;
  FrameFlux flux;
  std::span<const float> error;  ///< none unless it is shown
};

void print_summary(const DrawnFrame& drawn, const RenderOptions& chosen,
                   const CommonOptions& options) {
  const Picture& picture = drawn.picture;
  if (options.json) {
    nlohmann::json summary = {
        {"width", picture.width},
        {"height", picture.height},
        {"show", chosen.show},
        {"exposure", picture.exposure},
        {"camera", as_json(drawn.camera)},
        {"lumens", as_json(drawn.flux)},
        {"microseconds", {{"direct", drawn.times.direct}, {"product", drawn.times.product}}}};
    if (!drawn.error.empty()) summary["error_max"] = *std::ranges::max_element(drawn.error);
    print_json(summary);
  } else if (!options.quiet) {
    fmt::print("{}: {}x{}, exposure {:+.2f} EV\n{}\n", chosen.output, picture.width, picture.height,
               picture.exposure, described(drawn.camera));
    if (parse_show(chosen.show) == Show::kPatches) return;
    fmt::print("{}\ndirect light {:.2f} ms, all lamps anew; product {:.3f} ms\n",
               described(drawn.flux), drawn.times.direct / 1e3, drawn.times.product / 1e3);
  }
}

void run(const RenderOptions& chosen, const CommonOptions& options) {
  PictureSettings settings;
  std::tie(settings.width, settings.height) = parse_size(chosen.size);
  settings.show = parse_show(chosen.show);
  settings.exposure = chosen.exposure;
  check_can_write(chosen.output);
  LightSetup setup;
  const bool needs_no_light =
      chosen.key_light || (settings.show == Show::kPatches && chosen.lights.empty());
  const auto data = needs_no_light
                        ? std::make_shared<const TransferData>(load_transfer_file(chosen.file))
                        : load_lit_scene(chosen.file, chosen.lights, setup);

  Engine engine(data);
  if (chosen.key_light) setup.lights = {make_key_light(*data, *engine.parts().tracer)};
  const FrameTimes times = relight_timed(engine, setup.lights, setup.sky);
  warn_of_lamps(engine, setup.lights, options);
  const ChosenCamera camera = choose_camera(chosen.camera, *data, *engine.parts().tracer);
  settings.camera = camera.camera;
  const std::vector<Float3> emitted_irradiance = irradiance_from_emitters(*data);
  std::vector<float> error;
  if (settings.show == Show::kError) error = errors_of(engine);

  PictureLight light;
  light.lights = setup.lights;
  light.sky = setup.sky;
  light.indirect_irradiance = engine.indirect_irradiance();
  light.emitted_irradiance = emitted_irradiance;
  const std::vector<Float3> reflected = reflected_exitance(engine);
  light.reflected_exitance = reflected;
  light.error = error;
  const PictureRenderer renderer(*data, *engine.parts().tracer);
  if (!settings.exposure && shows_light(settings.show)) {
    settings.exposure = exposure_for(renderer, light, settings.camera, settings.show);
  }
  const Picture picture = renderer.render(light, settings);
  write_png(chosen.output, tone_map(picture));
  print_summary({picture, camera, times, flux_of(engine, engine.indirect_irradiance()), error},
                chosen, options);
}

}  // namespace

void add_render_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<RenderOptions>();
  CLI::App* command =
      app.add_subcommand("render", "Draw a picture of a relit scene, without a window");
  command->add_option("file", chosen->file, "Transfer file")->required();
  CLI::Option* lights =
      command->add_option("--lights", chosen->lights,
                          "Lights: .json, or a .glb that has some; by default those of the scene");
  command->add_flag("--key-light", chosen->key_light, "One lamp at a place that suits the scene")
      ->excludes(lights);
  command->add_option("--camera", chosen->camera, kCameraHelp);
  command->add_option("--size", chosen->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
  command
      ->add_option("--show", chosen->show,
                   "direct, indirect (bounced light only), radiosity (both), patches, or error "
                   "(of the indirect irradiance against the reference solution)")
      ->check(CLI::IsMember(show_names()))
      ->capture_default_str();
  command->add_option("--exposure", chosen->exposure,
                      "Stops; by default found from what the camera sees");
  command->add_option("-o,--output", chosen->output, "Image to write (.png)")
      ->required()
      ->check([](const std::string& path) {
        return std::filesystem::path(path).extension() == ".png" ? "" : "must end in .png";
      });
  command->callback([chosen, &options] { run(*chosen, options); });
}

}  // namespace rebounce::cli

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "precompute/cli/chosen_lights.h"
#include "precompute/cli/commands.h"
#include "precompute/cli/light_path_file.h"
#include "precompute/cli/method_names.h"
#include "precompute/cli/moving_sphere.h"
#include "precompute/cli/output_check.h"
#include "precompute/cli/picture_options.h"
#include "precompute/lights/reference_solution.h"
#include "rebounce/error.h"
#include "runtime/demo/image/image_file.h"
#include "runtime/demo/picture/key_light.h"
#include "runtime/demo/viewer/window/viewer.h"
#include "runtime/frame/engine_parts.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::cli {
namespace {

struct ViewOptions {
  std::string file, lights, camera, size = "1280x800", show = "radiosity";
  std::optional<float> exposure;
  std::string method = kTransferMethod, against;
  int sweeps = 1;
  bool cold = false, panels = false, sphere = false;
  std::string screenshot, path, out;
  int frames = 1;
};

/// The product and direct light on the graphics card, of the viewer alone.
constexpr const char* kCardMethod = "graphics-card";

std::vector<std::string> viewer_method_names() {
  std::vector<std::string> names = method_names();
  names.emplace_back(kCardMethod);
  return names;
}

IndirectMethod method_of(const std::string& name, const ViewOptions& chosen) {
  IndirectMethod method{.sweeps = chosen.sweeps, .warm = !chosen.cold};
  method.on_links = name == kHierarchicalMethod;
  method.on_card = name == kCardMethod;
  if (name != kTransferMethod && !method.on_links && !method.on_card) {
    method.iteration = std::ranges::find(kSolveMethods, name, &NamedSolveMethod::name)->method;
  }
  return method;
}

bool emits(const TransferData& data) {
  return std::ranges::any_of(data.patches.emitted_exitance,
                             [](const Float3& m) { return m[0] > 0 || m[1] > 0 || m[2] > 0; });
}

/// The lights that were asked for, `given`, or those of the scene, or one lamp if there would be
/// none.
LightSetup lights_to_begin_with(const ViewOptions& chosen, const LightSetup& given,
                                const Engine& engine) {
  if (!chosen.lights.empty()) return given;
  const TransferData& data = engine.data();
  if (!data.lights.empty() || emits(data)) return choose_lights({}, data);
  LightSetup setup;
  setup.lights = {make_key_light(data, *engine.parts().tracer)};
  return setup;
}

ViewerSetup make_setup(const ViewOptions& chosen, const std::shared_ptr<const TransferData>& data,
                       const LightSetup& given, const CommonOptions& options,
                       ChosenCamera& camera) {
  Engine engine(data);
  const LightSetup lights = lights_to_begin_with(chosen, given, engine);
  engine.relight(lights.lights, lights.sky);
  warn_of_lamps(engine, lights.lights, options);
  ViewerSetup setup;
  setup.title = "Rebounce: " + data->record.scene_name;
  std::tie(setup.width, setup.height) = parse_size(chosen.size);
  for (const Light& light : lights.lights) setup.lights.push_back({.light = light});
  setup.sky = lights.sky;
  camera = choose_camera(chosen.camera, *data, *engine.parts().tracer);
  setup.camera = camera.camera;
  if (chosen.sphere) {
    setup.spheres.push_back(sphere_ahead(setup.camera, *engine.parts().tracer, *data));
  }
  setup.make_probes = [data] { return make_probes_for_view(*data); };
  setup.show = parse_show(chosen.show);
  setup.exposure = chosen.exposure;
  setup.methods[0] = method_of(chosen.method, chosen);
  if (!chosen.against.empty()) {
    setup.methods[1] = method_of(chosen.against, chosen);
    setup.split = 0.5F;
  }
  setup.panels = chosen.panels;
  if (has_form_factors(*data) || !data->links.empty() || setup.show == Show::kError) {
    setup.reference = [data, solver = std::make_shared<const ReferenceSolver>(*data)](
                          std::span<const Float3> exitance) {
      return solver->indirect_irradiance(exitance);
    };
  }
  return setup;
}

void report(const StageTimes& times, int frames, const ChosenCamera& camera,
            const CommonOptions& options) {
  nlohmann::json card = nlohmann::json::object();
  double on_card = 0;
  for (const GpuStageTime& stage : times.card) {
    card[stage.name] = stage.microseconds;
    on_card += stage.microseconds;
  }
  const nlohmann::json summary = {{"frames", frames},
                                  {"camera", as_json(camera)},
                                  {"microseconds",
                                   {{"direct", times.direct},
                                    {"solve", times.solve[0]},
                                    {"solve_right", times.solve[1]},
                                    {"upload", times.upload},
                                    {"shadows", times.shadows},
                                    {"draw", times.draw},
                                    {"card", card}}}};
  if (options.json) {
    print_json(summary);
  } else if (!options.quiet) {
    fmt::print(
        "{} frames; median milliseconds: direct {:.2f}, solve {:.2f}, upload {:.2f}, "
        "shadows {:.2f}, graphics card {:.2f}, draw {:.2f}\n{}\n",
        frames, times.direct / 1e3, (times.solve[0] + times.solve[1]) / 1e3, times.upload / 1e3,
        times.shadows / 1e3, on_card / 1e3, times.draw / 1e3, described(camera));
  }
}

void write_pictures(const ViewOptions& chosen, const std::shared_ptr<const TransferData>& data,
                    const ViewerSetup& setup, const ChosenCamera& camera, float frames_per_second,
                    const CommonOptions& options) {
  if (!chosen.out.empty()) std::filesystem::create_directories(chosen.out);
  ProgressBar progress(!options.quiet && !options.json);
  const auto write = [&](int frame, const ScreenImage& image) {
    const std::filesystem::path name =
        chosen.out.empty()
            ? std::filesystem::path(chosen.screenshot)
            : std::filesystem::path(chosen.out) / fmt::format("frame_{:05}.png", frame);
    write_png(name, image);
    if (!progress.update("drawing", static_cast<double>(frame + 1) / chosen.frames)) {
      throw Error(
          fmt::format("stopped on request after {} of {} pictures", frame + 1, chosen.frames));
    }
  };
  const StageTimes times = draw_viewer_frames(data, setup, chosen.frames, frames_per_second, write);
  report(times, chosen.frames, camera, options);
}

void run(const ViewOptions& chosen, const CommonOptions& options) {
  if (!chosen.screenshot.empty()) check_can_write(chosen.screenshot);
  LightSetup given;
  const auto data = chosen.lights.empty()
                        ? std::make_shared<const TransferData>(load_transfer_file(chosen.file))
                        : load_lit_scene(chosen.file, chosen.lights, given);
  ChosenCamera camera;
  ViewerSetup setup = make_setup(chosen, data, given, options, camera);
  float frames_per_second = 30;
  if (!chosen.path.empty()) {
    frames_per_second = read_light_path(chosen.path, setup.lights, setup.spheres);
  }
  if (chosen.screenshot.empty() && chosen.out.empty()) {
    run_viewer(data, setup, [] { return !interrupted(); });
  } else {
    write_pictures(chosen, data, setup, camera, frames_per_second, options);
  }
}

void add_picture_options(CLI::App& command, ViewOptions& chosen) {
  CLI::Option* screenshot =
      command.add_option("--screenshot", chosen.screenshot,
                         "Write one picture (.png) instead of opening a window; needs no display");
  screenshot->check([](const std::string& path) {
    return std::filesystem::path(path).extension() == ".png" ? "" : "must end in .png";
  });
  command.add_option(
      "--path", chosen.path,
      "How lamps and spheres move, in the window or in the pictures of --out: a .json file "
      "(notes/reference/light_path_file.md)");
  CLI::Option* out = command.add_option(
      "--out", chosen.out, "Write pictures frame_00000.png ... into this folder, without a window");
  out->excludes(screenshot);
  command.add_option("--frames", chosen.frames, "How many pictures")
      ->check(CLI::Range(1, 1000000))
      ->needs(out)
      ->capture_default_str();
  command.add_flag("--panels", chosen.panels, "Pictures show panels and handles too");
}

}  // namespace

void add_view_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<ViewOptions>();
  CLI::App* command = app.add_subcommand("view", "Fly through a scene and move its lights");
  command->add_option("file", chosen->file, "Transfer file")->required();
  command->add_option("--lights", chosen->lights,
                      "Lights: .json, or a .glb that has some; by default those of the scene, or "
                      "one lamp if nothing in it shines");
  command->add_option("--camera", chosen->camera, fmt::format("First camera. {}", kCameraHelp));
  command->add_option("--size", chosen->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
  command->add_option("--show", chosen->show, "First view: as for render")
      ->check(CLI::IsMember(show_names()))
      ->capture_default_str();
  command->add_option("--exposure", chosen->exposure,
                      "Stops; by default found from what the first picture shows, as render does");
  command->add_option("--method", chosen->method, "How to find the indirect light")
      ->check(CLI::IsMember(viewer_method_names()))
      ->capture_default_str();
  command->add_option("--against", chosen->against, "Split the screen; this method on the right")
      ->check(CLI::IsMember(viewer_method_names()));
  command->add_option("--sweeps", chosen->sweeps, "Sweeps a frame, for iterative methods")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_flag("--cold", chosen->cold,
                    "Iterative methods start each frame anew, not from the last solution");
  command->add_flag("--sphere", chosen->sphere,
                    "A sphere that moves in front of the camera, lit by light probes");
  add_picture_options(*command, *chosen);
  command->callback([chosen, &options] { run(*chosen, options); });
}

}  // namespace rebounce::cli

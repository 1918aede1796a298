#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "precompute/cli/chosen_lights.h"
#include "precompute/cli/commands.h"
#include "precompute/cli/output_check.h"
#include "precompute/cli/picture_options.h"
#include "runtime/demo/bake/glb_file.h"
#include "runtime/demo/bake/lit_mesh.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::cli {
namespace {

struct BakeOptions {
  std::string file, lights, camera, output;
  LitMeshSettings settings;
};

void run(const BakeOptions& chosen, const CommonOptions& options) {
  check_can_write(chosen.output);
  LightSetup setup;
  const auto data = load_lit_scene(chosen.file, chosen.lights, setup);
  Engine engine(data);
  engine.relight(setup.lights, setup.sky);
  warn_of_lamps(engine, setup.lights, options);
  const std::vector<Float3> emitted = irradiance_from_emitters(*data);
  const std::vector<Float3> reflected = reflected_exitance(engine);
  const PictureLight light{.lights = setup.lights,
                           .sky = setup.sky,
                           .indirect_irradiance = engine.indirect_irradiance(),
                           .emitted_irradiance = emitted,
                           .reflected_exitance = reflected};
  const RayTracer& tracer = *engine.parts().tracer;
  const ChosenCamera camera = choose_camera(chosen.camera, *data, tracer);
  const LitMesh mesh = light_mesh(*data, tracer, light, camera.camera, chosen.settings);
  const std::size_t bytes = write_glb(chosen.output, mesh, *data, setup.lights);
  if (options.json) {
    const nlohmann::json summary = {{"vertices", mesh.position.size()},
                                    {"triangles", mesh.index.size() / 3},
                                    {"texture", {mesh.texture.width, mesh.texture.height}},
                                    {"exposure", mesh.exposure},
                                    {"camera", as_json(camera)},
                                    {"bytes", bytes}};
    print_json(summary);
  } else if (!options.quiet) {
    const std::string texture =
        mesh.texture.rgb.empty()
            ? std::string()
            : fmt::format("lightmap {} x {}, ", mesh.texture.width, mesh.texture.height);
    fmt::print("{}: {} triangles, {} vertices, {}exposure {:+.2f} EV, {} bytes\n", chosen.output,
               mesh.index.size() / 3, mesh.position.size(), texture, mesh.exposure, bytes);
    if (!chosen.settings.exposure) fmt::print("exposure for {}\n", described(camera));
  }
}

}  // namespace

void add_bake_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<BakeOptions>();
  CLI::App* command =
      app.add_subcommand("bake", "Write the lit scene as a .glb that any glTF viewer shows lit");
  command->add_option("file", chosen->file, "Transfer file")->required();
  command->add_option("--lights", chosen->lights,
                      "Lights: .json, or a .glb that has some; by default those of the scene");
  command->add_option("--exposure", chosen->settings.exposure,
                      "Stops; by default found from what the camera sees, as render does");
  command->add_option("--camera", chosen->camera,
                      fmt::format("Camera that the exposure is found for. {}", kCameraHelp));
  command
      ->add_option("--triangles", chosen->settings.triangle_target,
                   "Subdivide triangles without lightmap texels evenly, as finely as keeps their "
                   "number below this")
      ->check(CLI::Range(std::size_t{1}, std::size_t{20000000}))
      ->capture_default_str();
  command->add_option("-o,--output", chosen->output, "Scene to write (.glb)")
      ->required()
      ->check([](const std::string& path) {
        return std::filesystem::path(path).extension() == ".glb" ? "" : "must end in .glb";
      });
  command->callback([chosen, &options] { run(*chosen, options); });
}

}  // namespace rebounce::cli

#include "precompute/cli/chosen_lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "rebounce/error.h"
#include "runtime/frame/lamp_warnings.h"
#include "runtime/lights/emitting_material.h"
#include "transfer/base/argument_check.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::cli {
namespace {

/// Metres per unit of the scene file that `data` were made from.
double scale_of(const TransferData& data) {
  const auto settings = nlohmann::json::parse(data.settings_json, nullptr, false);
  if (!settings.is_object() || !settings.contains("scale")) return 1;
  const auto& scale = settings["scale"];
  return scale.is_number() && scale.get<double>() > 0 ? scale.get<double>() : 1;
}

/// Multiplies light by a scale. Throws Error if that is not finite any more.
void multiply(Float3& light, const EmitterScale& emitter) {
  for (int c = 0; c < kChannelCount; ++c) light[c] *= emitter.scale[c];
  if (!is_light(light)) {
    throw Error(fmt::format("\"emitters\": the scale of \"{}\" makes light that is not finite",
                            emitter.material));
  }
}

/// Scales the emission of a material. Throws Error if the scene has no material of that name.
void scale_emitter(const EmitterScale& emitter, std::span<const std::uint32_t> patch_material,
                   TransferData& data) {
  bool found = false;
  for (std::uint32_t m = 0; m < data.materials.size(); ++m) {
    if (data.materials[m].name != emitter.material) continue;
    found = true;
    multiply(data.materials[m].emitted_luminance, emitter);
    for (std::size_t i = 0; i < patch_material.size(); ++i) {
      if (patch_material[i] == m) multiply(data.patches.emitted_exitance[i], emitter);
    }
  }
  if (!found) {
    throw Error(fmt::format("the scene has no material \"{}\" to scale; check \"emitters\"",
                            emitter.material));
  }
}

}  // namespace

LightSetup choose_lights(const std::filesystem::path& path, const TransferData& data) {
  LightSetup setup;
  if (path.empty()) {
    setup.lights = data.lights;
  } else {
    setup = read_lights(path, scale_of(data));
  }
  const bool emits = std::ranges::any_of(data.patches.emitted_exitance, [](const Float3& m) {
    return m[0] > 0 || m[1] > 0 || m[2] > 0;
  });
  if (setup.lights.empty() && setup.sky.luminance == 0 && !emits) {
    throw Error("there is no light: " +
                (path.empty()
                     ? "the scene has no lights of its own and nothing in it emits; name a file "
                       "with --lights"
                     : path.string() + " has no lights and no sky, and nothing in the scene emits; "
                                       "add one") +
                ", or see the scene with render --key-light");
  }
  return setup;
}

std::shared_ptr<const TransferData> load_lit_scene(const std::filesystem::path& file,
                                                   const std::filesystem::path& lights,
                                                   LightSetup& setup) {
  TransferData data = load_transfer_file(file);
  setup = choose_lights(lights, data);
  const std::vector<std::uint32_t> patch_material = find_emitting_material(data);
  for (const EmitterScale& emitter : setup.emitters) {
    scale_emitter(emitter, patch_material, data);
  }
  if (!setup.emitters.empty()) data.emitted_irradiance.clear();  // it is that of other emission
  return std::make_shared<const TransferData>(std::move(data));
}

void warn_of_lamps(const Engine& engine, std::span<const Light> lights,
                   const CommonOptions& options) {
  if (options.quiet) return;
  for (const std::string& line : lamp_warnings(engine, lights)) {
    print_note(options, "warning: " + line);
  }
}

}  // namespace rebounce::cli

// A light file, and after a byte of 0 a light path file and after another an IES file, which the
// light file may name as lamp.ies. The lamps are moved and lit with.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "precompute/cli/light_path_file.h"
#include "precompute/import/light_file.h"
#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "tests/fuzz/fuzz_target.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::fuzz {
namespace {

std::array<Bytes, 3> split(Bytes input) {
  std::array<Bytes, 3> parts;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const auto end = k + 1 < parts.size() ? std::ranges::find(input, 0) : input.end();
    parts[k] = {input.begin(), end};
    input = input.subspan(std::min(parts[k].size() + 1, input.size()));
  }
  return parts;
}

// As many patches as the operator of the tests' own file has.
std::shared_ptr<const TransferData> transfer() {
  static const auto data =
      load_transfer(std::filesystem::path(REBOUNCE_SOURCE_DIR) / "tests/fuzz/room.safetensors");
  return data;
}

void light_with(const std::vector<Light>& lights, const Sky& sky) {
  static Engine engine(transfer(), {.direct_lighting = {.points_per_patch = 1}});
  constexpr std::size_t kMost = 16;  // more take longer and find no more
  engine.relight(std::span(lights).first(std::min(lights.size(), kMost)), sky);
}

void move_lights(const LightSetup& setup, const std::filesystem::path& path) {
  std::vector<ViewerLight> lights;
  for (const Light& light : setup.lights) lights.push_back({light});
  std::vector<ViewerSphere> spheres;
  cli::read_light_path(path, lights, spheres);
  std::vector<Light> at_time;
  for (const float time : {0.0F, 0.7F, 1e6F}) {
    at_time.clear();
    for (const ViewerLight& lamp : lights) at_time.push_back(moved(lamp.light, lamp.motion, time));
    for (const ViewerSphere& sphere : spheres) moved(sphere.position, sphere.motion, time);
  }
  light_with(at_time, setup.sky);
}

}  // namespace
}  // namespace rebounce::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace rebounce;
  static const fuzz::InputFolder folder;
  const auto [lights, path, profile] = fuzz::split({data, size});
  folder.write("lamp.ies", profile);
  try {
    const LightSetup setup = read_lights(folder.write("input.lights.json", lights));
    fuzz::light_with(setup.lights, setup.sky);
    fuzz::move_lights(setup, folder.write("input.path.json", path));
  } catch (const Error& refusal) {
    fuzz::require_one_line(refusal.what());
  }
  return 0;
}

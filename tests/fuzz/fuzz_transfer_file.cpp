// A transfer file, and all that a runtime does with one; or form factors apart, as pages have them.
// The checksum of the input is put right first, so that what it holds is what counts.

#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "rebounce/outputs.h"
#include "rebounce/solvers.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/transfer_file_tampering.h"
#include "transfer/file/transfer_data.h"
#include "transfer/file/transfer_file_format.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::fuzz {
namespace {

/// Runs `work`, which may refuse what it is given.
template <typename Work>
void may_refuse(const Work& work) {
  try {
    work();
  } catch (const Error& refusal) {
    require_one_line(refusal.what());
  }
}

// Exactly as large as the input.
std::vector<std::byte> sealed(Bytes input) {
  std::string file(reinterpret_cast<const char*>(input.data()), input.size());
  test::reseal(file);
  std::vector<std::byte> bytes(file.size());
  if (!bytes.empty()) std::memcpy(bytes.data(), file.data(), file.size());
  return bytes;
}

std::vector<Light> lamps(const TransferData& data) {
  Light sun;
  sun.type = LightType::kDirectional;
  Light sphere;
  sphere.type = LightType::kSphere;
  sphere.radius = 0.1F;
  std::vector<Light> lamps{Light{}, sun, sphere};
  lamps.insert(lamps.end(), data.lights.begin(), data.lights.end());
  return lamps;
}

Sky sky_for(const TransferData& data) {
  Sky sky;
  sky.luminance = 100;
  if (!data.sky_cells.entry_begin.empty()) {
    sky.distribution = std::make_shared<const SkyDistribution>(cie_sky(12, {0, -1, 1}));
  }
  return sky;
}

void use_outputs(Engine& engine) {
  const TransferData& data = engine.data();
  std::vector<Float3> of_vertices(data.mesh.position.size());
  may_refuse([&] { vertex_irradiance(engine, of_vertices); });
  may_refuse([&] { vertex_direct_irradiance(engine, of_vertices); });
  std::vector<SurfaceLight> surface(of_vertices.size());
  may_refuse([&] { vertex_light(engine, surface); });
  std::vector<Float3> texels(std::size_t{data.lightmap.width} * data.lightmap.height);
  may_refuse([&] { lightmap_irradiance(engine, texels); });
  std::vector<ProbeLight> probes(data.probes.position.size());
  may_refuse([&] { probe_light(engine, probes); });
  may_refuse([&] { interpolate_probes(data.probes, probes, {0.25F, 0.5F, 0.75F}); });
  may_refuse([&] { light_in_air(engine, {0.25F, 0.5F, 0.75F}); });
}

void use_frames(const std::shared_ptr<const TransferData>& data) {
  Engine engine(data, {.direct_lighting = {.points_per_patch = 2, .area_light_samples = 1}});
  may_refuse([&] { engine.relight(lamps(*data), sky_for(*data)); });
  may_refuse([&] { engine.set_emission_scale(0, {2, 1, 0}); });
  may_refuse([&] { engine.relight(std::vector<Float3>(data->patches.size(), Float3{1, 2, 3})); });
  use_outputs(engine);
}

void use_solvers(const std::shared_ptr<const TransferData>& data) {
  const std::vector<Float3> light(data->patches.size(), Float3{3, 2, 1});
  for (const auto source :
       {FormFactorSource::kExact, FormFactorSource::kCompressed, FormFactorSource::kLinks}) {
    for (const NamedSolveMethod& named : kSolveMethods) {
      may_refuse([&] { Solver(data, named.method, source).solve(light, {.max_sweeps = 1}); });
    }
  }
}

// The file that the form factors of an input must be of.
const TransferData& page() {
  static const auto data =
      load_transfer(std::filesystem::path(REBOUNCE_SOURCE_DIR) / "tests/fuzz/page.safetensors");
  return *data;
}

void use_form_factors(std::vector<std::byte> bytes) {
  const SafetensorsFile file(SharedArray(std::move(bytes)), "input.form_factors.safetensors");
  const auto read = read_form_factor_file(file, page());
  std::vector<float> workspace(read->workspace_size());
  std::vector<Float3> result(page().patches.size());
  read->apply(page().patches.reflectance, result, workspace);
}

bool has_form_factors_alone(Bytes input) {
  const std::string_view text(reinterpret_cast<const char*>(input.data()), input.size());
  return text.find(kFormFactorFormatName) != std::string_view::npos;
}

}  // namespace
}  // namespace rebounce::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace rebounce;
  if (fuzz::has_form_factors_alone({data, size})) {
    fuzz::may_refuse([&] { fuzz::use_form_factors(fuzz::sealed({data, size})); });
    return 0;
  }
  fuzz::may_refuse([&] {
    const auto transfer = read_transfer(fuzz::sealed({data, size}), "input.safetensors");
    fuzz::may_refuse([&] { fuzz::use_frames(transfer); });
    fuzz::use_solvers(transfer);
  });
  return 0;
}

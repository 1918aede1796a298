#include "bench/bounced_light.h"

#include <vector>

#include "transfer/base/reflection.h"

namespace rebounce::bench {
namespace {

using Lights = std::vector<std::vector<Float3>>;

constexpr int kBounces = 2;

Lights bounced_lights(const Lights& lights, const FormFactorOperator& form_factors,
                      const PatchTable& patches) {
  std::vector<float> workspace(form_factors.workspace_size());
  std::vector<Float3> arrived(patches.size());
  Lights radiosities;
  for (const auto& initial : lights) {
    std::vector<Float3>& radiosity = radiosities.emplace_back(initial);
    for (int bounce = 0; bounce < kBounces; ++bounce) {
      form_factors.gather(radiosity, arrived, workspace);
      add_reflected(initial, patches.reflectance, arrived, radiosity);
    }
  }
  return radiosities;
}

}  // namespace

DrawnLights bounced(const DrawnLights& lights, const FormFactorOperator& form_factors,
                    const PatchTable& patches) {
  return {bounced_lights(lights.training, form_factors, patches),
          bounced_lights(lights.validation, form_factors, patches)};
}

}  // namespace rebounce::bench

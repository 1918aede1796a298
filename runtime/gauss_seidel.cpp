#include "rebounce/runtime/gauss_seidel.h"

#include <cmath>

#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"

namespace rebounce {

GaussSeidelResult solve_gauss_seidel(const FormFactorRows& form_factors,
                                     std::span<const Float3> reflectance,
                                     std::span<const float> area,
                                     std::span<const Float3> initial_exitance,
                                     const GaussSeidelSettings& settings,
                                     std::span<Float3> radiosity) {
  const std::size_t n = form_factors.patch_count();
  if (reflectance.size() != n || area.size() != n || initial_exitance.size() != n ||
      radiosity.size() != n) {
    throw Error("Gauss-Seidel: form factors, patches and light differ in number");
  }
  const double norm = area_norm(initial_exitance, area);
  GaussSeidelResult result;
  do {
    double changed = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Float3 h = form_factors.gather_row(i, radiosity);
      for (int c = 0; c < kChannelCount; ++c) {
        const float next = initial_exitance[i][c] + reflectance[i][c] * h[c];
        const double change = static_cast<double>(next) - radiosity[i][c];
        changed += area[i] * change * change;
        radiosity[i][c] = next;
      }
    }
    ++result.sweeps;
    result.residual = norm > 0 ? std::sqrt(changed) / norm : 0;
  } while (result.sweeps < settings.max_sweeps && result.residual > settings.residual);
  return result;
}

}  // namespace rebounce

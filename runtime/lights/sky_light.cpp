#include "runtime/lights/sky_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rebounce/error.h"

namespace rebounce {
namespace {

Float3 scaled(const Sky& sky, float factor) {
  const float luminance = sky.luminance * factor;
  return {luminance * sky.color[0], luminance * sky.color[1], luminance * sky.color[2]};
}

}  // namespace

Float3 sky_irradiance(const TransferData& data, const Sky& sky, std::size_t patch) {
  // A uniform sky of luminance L gives the irradiance pi L to a patch that sees nothing else.
  constexpr float kPi = std::numbers::pi_v<float>;
  if (!sky.distribution) return scaled(sky, kPi * data.patches.sky_visibility[patch]);
  const SkyCells& cells = data.sky_cells;
  float seen = 0;
  for (std::uint32_t e = cells.entry_begin[patch]; e < cells.entry_begin[patch + 1]; ++e) {
    seen += cells.entry_part[e] * (*sky.distribution)[cells.entry_cell[e]];
  }
  return scaled(sky, kPi * seen);
}

Float3 sky_luminance(const Sky& sky, const Float3& direction) {
  return scaled(sky, sky.distribution ? (*sky.distribution)[sky_cell(direction)] : 1.0F);
}

Float3 sky_luminance_unit(const Sky& sky) {
  return scaled(sky, 1);
}

Float3 mean_sky_luminance(const Sky& sky) {
  if (!sky.distribution) return scaled(sky, 1);
  float sum = 0;
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) {
    sum += (*sky.distribution)[cell] * sky_cell_solid_angle(cell);
  }
  return scaled(sky, sum / (2 * std::numbers::pi_v<float>));
}

void check_sky(const Sky& sky, const TransferData& data) {
  const auto is_bad = [](float x) { return !(std::isfinite(x) && x >= 0); };
  if (std::ranges::any_of(sky.color, is_bad) || is_bad(sky.luminance) ||
      (sky.distribution && std::ranges::any_of(*sky.distribution, is_bad))) {
    throw Error("the sky's color, luminance and distribution must be finite and at least 0");
  }
  const float most = sky.distribution ? std::ranges::max(*sky.distribution) : 1;
  if (std::ranges::any_of(scaled(sky, std::numbers::pi_v<float> * most), is_bad)) {
    throw Error("the sky's luminance times its color and its distribution must be finite");
  }
  if (sky.distribution && data.sky_cells.empty()) {
    throw Error(
        "the transfer file does not say in which directions patches see the sky; precompute the "
        "scene again, or take a uniform sky");
  }
}

}  // namespace rebounce

#include "precompute/lights/sparse_light.h"

#include <algorithm>
#include <utility>

namespace rebounce {

SparseLight::SparseLight(std::span<const Float3> light) : size_(light.size()) {
  const auto is_lit = [](const Float3& value) { return value != Float3{}; };
  values_.reserve(static_cast<std::size_t>(std::ranges::count_if(light, is_lit)));
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (!is_lit(light[i])) continue;
    if (i == 0 || !is_lit(light[i - 1])) runs_.push_back({static_cast<std::uint32_t>(i), 0});
    ++runs_.back().count;
    values_.push_back(light[i]);
  }
  runs_.shrink_to_fit();
}

std::vector<Float3> SparseLight::expanded() const {
  std::vector<Float3> light(size_);
  auto from = values_.begin();
  for (const Run& run : runs_) {
    std::copy_n(from, run.count, light.begin() + run.begin);
    from += run.count;
  }
  return light;
}

std::vector<SparseLight> sparse_lights(std::vector<std::vector<Float3>> lights) {
  std::vector<SparseLight> kept;
  kept.reserve(lights.size());
  for (std::vector<Float3>& light : lights) kept.emplace_back(std::exchange(light, {}));
  return kept;
}

std::vector<std::vector<Float3>> expanded(std::span<const SparseLight> lights) {
  std::vector<std::vector<Float3>> all;
  all.reserve(lights.size());
  for (const SparseLight& light : lights) all.push_back(light.expanded());
  return all;
}

}  // namespace rebounce

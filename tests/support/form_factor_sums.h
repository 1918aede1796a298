#pragma once

// What tests and benchmarks ask of form factors as a whole.

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/exchange/pairs/form_factors.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test {

/// The sum of each row of F.
inline std::vector<double> row_sums_of(const PatchModel& model, const FormFactors& f) {
  std::vector<double> sum(model.patches.size(), 0.0);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    for (std::uint64_t k = f.exchange.row_begin[i]; k < f.exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t j = f.exchange.column[k];
      sum[i] += f.exchange.exchange_area[k] / model.patches.area[i];
      if (j != i) sum[j] += f.exchange.exchange_area[k] / model.patches.area[j];
    }
  }
  return sum;
}

/// F from all patches of one material to all of another.
inline double factor_between(const PatchModel& model, const FormFactors& f, std::uint32_t from,
                             std::uint32_t to) {
  std::vector<std::uint32_t> material(model.patches.size());
  for (std::size_t i = 0; i < material.size(); ++i) material[i] = material_of(model, i);
  double exchange = 0, area = 0;
  for (std::size_t i = 0; i < material.size(); ++i) {
    if (material[i] == from) area += model.patches.area[i];
    for (std::uint64_t k = f.exchange.row_begin[i]; k < f.exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t j = f.exchange.column[k];
      const bool wanted =
          (material[i] == from && material[j] == to) || (material[j] == from && material[i] == to);
      if (wanted) exchange += f.exchange.exchange_area[k];
    }
  }
  return exchange / area;
}

/// A scene of two polygons, of materials 0 and 1.
inline Scene scene_of_two(const std::vector<glm::dvec3>& a, const std::vector<glm::dvec3>& b) {
  Scene scene = empty_scene();
  scene.materials.resize(2, scene.materials[0]);
  add_polygon(scene, a, 0);
  add_polygon(scene, b, 1);
  return scene;
}

}  // namespace rebounce::test

#pragma once

// A small scene made by hand for the tests of the runtime library.

#include <cstddef>
#include <memory>
#include <vector>

#include "runtime/rays/float3_glm.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce::test {

/// Adds a patch with a display triangle of its own.
inline void add_patch(TransferData& data, const glm::vec3& a, const glm::vec3& b,
                      const glm::vec3& c, const Float3& reflectance) {
  const auto first = static_cast<std::uint32_t>(data.mesh.position.size());
  const glm::vec3 cross = glm::cross(b - a, c - a);
  const auto patch = static_cast<std::uint32_t>(data.patches.size());
  data.patches.area.push_back(0.5F * glm::length(cross));
  data.patches.centroid.push_back(to_float3((a + b + c) / 3.0F));
  data.patches.normal.push_back(to_float3(glm::normalize(cross)));
  data.patches.reflectance.push_back(reflectance);
  data.patches.emitted_exitance.push_back({0, 0, 0});
  data.patches.sky_visibility.push_back(1);
  data.patches.absorbed.push_back(0);
  for (const glm::vec3& p : {a, b, c}) {
    data.mesh.position.push_back(to_float3(p));
    data.mesh.normal.push_back(data.patches.normal.back());
  }
  data.mesh.triangle.push_back({first, first + 1, first + 2});
  data.mesh.triangle_patch.push_back(patch);
  data.mesh.triangle_material.push_back(0);
  data.mesh.back_triangle.push_back(kNone);
}

/// The square [-size, size]² in the plane y = height, cut into steps² x 2 patches that face up or
/// down.
inline void add_square(TransferData& data, float size, float height, int steps, bool up,
                       const Float3& reflectance) {
  const float step = 2 * size / static_cast<float>(steps);
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const float x = -size + step * static_cast<float>(i),
                  z = -size + step * static_cast<float>(j);
      const glm::vec3 a(x, height, z), b(x, height, z + step), c(x + step, height, z + step),
          d(x + step, height, z);
      if (up) {
        add_patch(data, a, b, c, reflectance);
        add_patch(data, a, c, d, reflectance);
      } else {
        add_patch(data, a, c, b, reflectance);
        add_patch(data, a, d, c, reflectance);
      }
    }
  }
}

/// Form factors that share each patch's light evenly among the others, and the operator of one
/// bounce of it: not physics, but matrices with the right structure.
inline void add_even_exchange(TransferData& data) {
  const std::size_t n = data.patches.size();
  std::vector<std::uint64_t> begin = {0};
  std::vector<std::uint32_t> column;
  std::vector<float> exchange;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      column.push_back(static_cast<std::uint32_t>(j));
      exchange.push_back(data.patches.area[i] * data.patches.area[j]);
    }
    begin.push_back(column.size());
  }
  double total = 0;
  for (const float a : data.patches.area) total += a;
  for (float& s : exchange) s = static_cast<float>(s / total);
  DenseOperator::Storage storage;
  storage.area = data.patches.area;
  storage.matrix_count = 1;
  constexpr std::size_t kTile = DenseOperator::kTile;
  std::vector<float> tiles(DenseOperator::tile_count(n) * kTile * kTile, 0.0F);
  const auto at = [&](std::size_t i, std::size_t j) -> float& {
    const std::size_t row = i / kTile, col = j / kTile;
    return tiles[((row * (row + 1) / 2 + col) * kTile + i % kTile) * kTile + j % kTile];
  };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const auto g =
          static_cast<float>(std::sqrt(data.patches.area[i] * data.patches.area[j]) / total);
      if (i == j) continue;
      at(i, j) = g;
      if (i / kTile == j / kTile) at(j, i) = g;
    }
  }
  storage.tiles_f32 = SharedArray(std::move(tiles));
  data.transfer = std::make_shared<const DenseOperator>(std::move(storage));
  data.exchange = {SharedArray(std::move(begin)), SharedArray(std::move(column)),
                   SharedArray(std::move(exchange))};
}

}  // namespace rebounce::test

#pragma once

// A small scene made by hand for the tests of the runtime library.

#include <array>
#include <cstddef>
#include <memory>
#include <random>
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

/// Two squares that face each other; the operator is that of the first bounce alone.
inline std::shared_ptr<TransferData> facing_squares() {
  auto data = std::make_shared<TransferData>();
  add_square(*data, 1, 0, 4, true, {0.5F, 0.4F, 0.3F});
  add_square(*data, 1, 2, 4, false, {0.2F, 0.7F, 0.6F});
  add_even_exchange(*data);
  return data;
}

/// A parallelogram from `corner` along `x` and `y`, cut into steps² x 2 patches; its front is where
/// they turn counter-clockwise.
inline void add_parallelogram(TransferData& data, const glm::vec3& corner, const glm::vec3& x,
                              const glm::vec3& y, int steps) {
  const auto at = [&](int i, int j) {
    return corner +
           (x * static_cast<float>(i) + y * static_cast<float>(j)) / static_cast<float>(steps);
  };
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      add_patch(data, at(i, j), at(i + 1, j), at(i + 1, j + 1), {0.5F, 0.5F, 0.5F});
      add_patch(data, at(i, j), at(i + 1, j + 1), at(i, j + 1), {0.5F, 0.5F, 0.5F});
    }
  }
}

/// The faces of a box around `middle` with half its sides; fronts outside, or inside.
inline void add_slanted_box(TransferData& data, const glm::vec3& middle,
                            const std::array<glm::vec3, 3>& half, bool inwards, int steps) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const glm::vec3 x = half[(axis + 1) % 3], y = half[(axis + 2) % 3];
    for (const float side : {-1.0F, 1.0F}) {
      const glm::vec3 corner = middle + side * half[axis] - x - y;
      const bool turned = (glm::dot(glm::cross(x, y), side * half[axis]) > 0) == inwards;
      add_parallelogram(data, corner, turned ? 2.0F * y : 2.0F * x, turned ? 2.0F * x : 2.0F * y,
                        steps);
    }
  }
}

/// A room of 4 x 3 x 4 m around the origin with `count` boxes in it. Each wall has steps² x 2
/// patches.
inline TransferData furnished_box(std::mt19937& engine, int count, int steps = 16) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return glm::vec3(uniform(engine), uniform(engine), uniform(engine)); };
  TransferData data;
  add_slanted_box(data, {0, 0, 0}, {glm::vec3(2, 0, 0), {0, 1.5F, 0}, {0, 0, 2}}, true, steps);
  for (int k = 0; k < count; ++k) {
    const glm::vec3 x = glm::normalize(any()), z = glm::normalize(glm::cross(x, any()));
    const glm::vec3 size = 0.05F + 0.25F * glm::abs(any());
    const glm::vec3 middle = any() * glm::vec3(1.4F, 0.9F, 1.4F);
    add_slanted_box(data, middle, {size.x * x, size.y * glm::cross(z, x), size.z * z}, false, 3);
  }
  return data;
}

/// A lamp of any direction in the middle part of that room.
inline Light lamp_in_box(std::mt19937& engine, LightType type) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return glm::vec3(uniform(engine), uniform(engine), uniform(engine)); };
  Light light;
  light.type = type;
  light.position = to_float3(any() * glm::vec3(1.8F, 1.3F, 1.8F));
  light.direction = to_float3(glm::normalize(any()));
  light.tangent = to_float3(glm::cross(to_glm(light.direction), any()));
  light.outer_cone_angle = 1;
  light.inner_cone_angle = 0.5F;
  light.radius = 0.1F;
  light.size = {0.3F, 0.1F};
  return light;
}

}  // namespace rebounce::test

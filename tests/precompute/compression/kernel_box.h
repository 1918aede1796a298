#pragma once

// A box whose form factors are a formula of the centres of its patches: a matrix of thousands of
// patches without a ray.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// The walls of a box, of as many patches along its edges.
inline PatchTable kernel_box(int side) {
  PatchTable patches;
  const float step = 1 / static_cast<float>(side);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float wall : {0.0F, 1.0F}) {
      for (int k = 0; k < side * side; ++k) {
        const int row = k / side, column = k % side;
        Float3 at, normal{};
        at[axis] = wall;
        at[(axis + 1) % 3] = step * (static_cast<float>(column) + 0.5F);
        at[(axis + 2) % 3] = step * (static_cast<float>(row) + 0.5F);
        normal[axis] = wall == 0 ? 1 : -1;
        patches.area.push_back(step * step);
        patches.centroid.push_back(at);
        patches.normal.push_back(normal);
        patches.reflectance.push_back({0.5F, 0.5F, 0.5F});
      }
    }
  }
  return patches;
}

/// Form factors of patches as small as points, by their centres: one matrix, symmetric.
class KernelMatrix final : public SymmetricMatrix {
 public:
  explicit KernelMatrix(const PatchTable& patches, PatchRoles roles = {})
      : SymmetricMatrix(std::move(roles)), patches_(patches) {
    const auto n = static_cast<Eigen::Index>(patches.size());
    all_.resize(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) all_(i, j) = entry(i, j);
    }
  }

  std::span<const float> area() const override { return patches_.area; }
  void entries(std::uint32_t, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override {
    for (std::size_t j = 0; j < columns.size(); ++j) {
      for (std::size_t i = 0; i < rows.size(); ++i) entries(i, j) = all_(rows[i], columns[j]);
    }
  }
  Eigen::MatrixXf multiply(std::uint32_t, const Eigen::MatrixXf& x) const override {
    return all_ * x;
  }

 private:
  float entry(Eigen::Index i, Eigen::Index j) const {
    float distance = 0, from = 0, to = 0;
    for (int c = 0; c < 3; ++c) {
      const float way = patches_.centroid[j][c] - patches_.centroid[i][c];
      distance += way * way;
      from += way * patches_.normal[i][c];
      to -= way * patches_.normal[j][c];
    }
    if (from <= 0 || to <= 0) return 0;
    const float area = std::sqrt(patches_.area[i] * patches_.area[j]);
    // Not nearer than a patch is large.
    const float least = std::max(distance, patches_.area[i]);
    return from * to * area / (std::numbers::pi_v<float> * least * least);
  }

  const PatchTable& patches_;
  Eigen::MatrixXf all_;
};

/// Each of a few spots of light on the walls, soft at their edges.
inline std::vector<std::vector<Float3>> soft_spots(const PatchTable& patches, int count,
                                                   std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<std::vector<Float3>> lights;
  for (int k = 0; k < count; ++k) {
    const Float3 at{uniform(engine), uniform(engine), uniform(engine)};
    const float width = 0.1F + 0.4F * uniform(engine);
    std::vector<Float3>& light = lights.emplace_back();
    for (const Float3& p : patches.centroid) {
      const float d = std::hypot(p[0] - at[0], p[1] - at[1], p[2] - at[2]) / width;
      const float m = 1 / (1 + d * d * d * d);
      light.push_back({m, m, m});
    }
  }
  return lights;
}

}  // namespace rebounce::test

#include "rebounce/transfer/low_rank_operator.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "half_float.h"
#include "kernels.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

constexpr std::size_t kTile = LowRankOperator::kTile;

// Ranks are padded to whole vectors of the widest instruction set.
constexpr std::size_t kVector = 16;

[[noreturn]] void refuse(const std::string& reason) {
  throw Error("low-rank operator: " + reason + "; make the file again");
}

/// The basis of one tile of patches as the kernels have it.
BasisPart basis_of_tile(std::size_t tile, std::size_t rank) {
  constexpr auto kSize = static_cast<std::uint32_t>(LowRankOperator::kTile);
  const auto ranks = static_cast<std::uint32_t>(rank);
  return {.values = tile * rank * kSize,
          .rank = ranks,
          .size = kSize,
          .coefficient = 0,
          .position = static_cast<std::uint32_t>(tile * kSize),
          .first_rank = 0,
          .last_rank = ranks,
          .first_place = 0,
          .last_place = kSize};
}

}  // namespace

std::size_t LowRankOperator::tile_count(std::size_t patch_count) {
  return (patch_count + kTile - 1) / kTile;
}

LowRankOperator::Storage LowRankOperator::encode_half(const Storage& storage) {
  Storage half = storage;
  half.precision = Precision::kF16;
  half.basis_f32 = {};
  std::vector<std::uint16_t> values(storage.basis_f32.size());
  // A basis is orthonormal: no entry is above 1.
  std::ranges::transform(storage.basis_f32, values.begin(), float_to_half);
  half.basis_f16 = SharedArray(std::move(values));
  return half;
}

LowRankOperator::LowRankOperator(Storage storage) : storage_(std::move(storage)) {
  const std::size_t n = patch_count(), rank = storage_.rank;
  if (n == 0) refuse("there are no patches");
  if (rank > n) refuse("its rank is above the number of patches");
  if (storage_.matrix_count < 1 || storage_.matrix_count > kChannelCount) {
    refuse("not 1, 2 or 3 matrices");
  }
  for (const std::uint32_t matrix : storage_.channel_matrix) {
    if (matrix >= storage_.matrix_count) refuse("a channel has no matrix");
  }
  const bool half = storage_.precision == Precision::kF16;
  const std::size_t basis = half ? storage_.basis_f16.size() : storage_.basis_f32.size();
  if (basis != tile_count(n) * rank * kTile) refuse("the basis is of another size");
  if (storage_.core.size() != storage_.matrix_count * rank * rank) {
    refuse("the cores are of another size");
  }
  sqrt_area_.reserve(n);
  for (const float area : storage_.area) sqrt_area_.push_back(std::sqrt(area));
  rank_stride_ = (rank + kVector - 1) / kVector * kVector;
}

std::size_t LowRankOperator::bytes() const {
  return storage_.basis_f32.size_bytes() + storage_.basis_f16.size_bytes() +
         storage_.core.size_bytes();
}

std::size_t LowRankOperator::bytes_per_apply() const {
  const std::size_t twice = storage_.basis_f32.size_bytes() + storage_.basis_f16.size_bytes();
  return 2 * twice + storage_.core.size_bytes();
}

std::size_t LowRankOperator::workspace_size() const {
  return kChannelCount * stride() + (tile_count(patch_count()) + 2) * coefficient_size();
}

void LowRankOperator::project(const float* x, float* tile_coefficient, float* coefficient) const {
  const std::size_t tiles = tile_count(patch_count());
  const BlockKernels& blocks = kernels().blocks;
#pragma omp parallel for schedule(static)
  for (std::size_t t = 0; t < tiles; ++t) {
    const BasisPart part = basis_of_tile(t, storage_.rank);
    const PlanarVectors<const float> in{x, stride(), kChannelCount};
    const Coefficients<float> out{tile_coefficient + t * coefficient_size(), coefficient_size()};
    if (storage_.precision == Precision::kF16) {
      blocks.bases_f16.project(storage_.basis_f16.data(), {&part, 1}, in, out);
    } else {
      blocks.bases_f32.project(storage_.basis_f32.data(), {&part, 1}, in, out);
    }
  }
  std::fill_n(coefficient, coefficient_size(), 0.0F);
  for (std::size_t t = 0; t < tiles; ++t) {
    const float* const part = tile_coefficient + t * coefficient_size();
    for (int c = 0; c < kChannelCount; ++c) {
      for (std::size_t r = 0; r < storage_.rank; ++r) {
        coefficient[c * rank_stride_ + r] += part[r * kChannelLanes + c];
      }
    }
  }
}

void LowRankOperator::multiply_cores(const float* in, float* out) const {
  const std::size_t rank = storage_.rank;
  const auto rows = static_cast<std::int64_t>(kChannelCount * rank);
#pragma omp parallel for schedule(static)
  for (std::int64_t k = 0; k < rows; ++k) {
    const std::size_t channel = k / rank, row = k % rank;
    const float* const core =
        storage_.core.data() + (storage_.channel_matrix[channel] * rank + row) * rank;
    const float* const x = in + channel * rank_stride_;
    // Sums of their own for neighbouring entries, so that the loop becomes vectors.
    std::array<float, kVector> sum{};
    std::size_t j = 0;
    for (; j + kVector <= rank; j += kVector) {
      for (std::size_t v = 0; v < kVector; ++v) sum[v] += core[j + v] * x[j + v];
    }
    for (std::size_t v = 0; j + v < rank; ++v) sum[v] += core[j + v] * x[j + v];
    float total = 0;
    for (const float s : sum) total += s;
    out[row * kChannelLanes + channel] = total;
  }
}

void LowRankOperator::expand_tiles(const float* coefficient, float* y) const {
  const std::size_t tiles = tile_count(patch_count());
  const BlockKernels& blocks = kernels().blocks;
  const Coefficients<const float> in{coefficient, coefficient_size()};
#pragma omp parallel for schedule(static)
  for (std::size_t t = 0; t < tiles; ++t) {
    for (int c = 0; c < kChannelCount; ++c) std::fill_n(y + c * stride() + t * kTile, kTile, 0.0F);
    const BasisPart part = basis_of_tile(t, storage_.rank);
    const PlanarVectors<float> out{y, stride(), kChannelCount};
    if (storage_.precision == Precision::kF16) {
      blocks.bases_f16.expand(storage_.basis_f16.data(), {&part, 1}, in, out);
    } else {
      blocks.bases_f32.expand(storage_.basis_f32.data(), {&part, 1}, in, out);
    }
  }
}

void LowRankOperator::apply(std::span<const Float3> initial_exitance,
                            std::span<Float3> indirect_irradiance,
                            std::span<float> workspace) const {
  const std::size_t n = patch_count();
  assert(initial_exitance.size() == n && indirect_irradiance.size() == n);
  assert(workspace.size() >= workspace_size());
  float* const x = workspace.data();
  float* const coefficient = x + kChannelCount * stride();
  float* const multiplied = coefficient + coefficient_size();
  for (int c = 0; c < kChannelCount; ++c) {
    float* const xc = x + c * stride();
    for (std::size_t i = 0; i < n; ++i) xc[i] = sqrt_area_[i] * initial_exitance[i][c];
    std::fill(xc + n, xc + stride(), 0.0F);
  }
  project(x, multiplied + coefficient_size(), coefficient);
  multiply_cores(coefficient, multiplied);
  expand_tiles(multiplied, x);
  for (std::size_t i = 0; i < n; ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      indirect_irradiance[i][c] = x[c * stride() + i] / sqrt_area_[i];
    }
  }
}

}  // namespace rebounce

#include "transfer/operator/low_rank_operator.h"

#include <algorithm>
#include <cmath>

#include "rebounce/error.h"
#include "transfer/base/half_float.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {
namespace {

// Ranks are padded to whole vectors of the widest instruction set.
constexpr std::size_t kVector = 16;

constexpr std::size_t kRowsPerTask = 64;  // rows of coupling matrices

[[noreturn]] void refuse(const std::string& reason) {
  throw Error("low-rank operator: " + reason + "; make the file again");
}

/// The basis of one tile of patches, as the kernels expect it.
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
          .first_offset = 0,
          .last_offset = kSize};
}

}  // namespace

std::size_t LowRankOperator::tile_count(std::size_t patch_count) {
  return (patch_count + LowRankOperator::kTile - 1) / LowRankOperator::kTile;
}

LowRankOperator::Storage LowRankOperator::encode_half(const Storage& storage) {
  Storage half = storage;
  half.precision = Precision::kF16;
  half.basis_f32 = {};
  std::vector<std::uint16_t> values(storage.basis_f32.size());
  // No entry of an orthonormal basis exceeds 1.
  std::ranges::transform(storage.basis_f32, values.begin(), float_to_half);
  half.basis_f16 = SharedArray(std::move(values));
  return half;
}

LowRankOperator::LowRankOperator(Storage storage) : storage_(std::move(storage)) {
  const std::size_t n = patch_count(), rank = storage_.rank;
  if (n == 0) refuse("there are no patches");
  if (rank > n) refuse("its rank is above the number of patches");
  if (storage_.matrix_count < 1 || storage_.matrix_count > kChannelCount) {
    refuse("the number of matrices is not 1, 2 or 3");
  }
  for (const std::uint32_t matrix : storage_.channel_matrix) {
    if (matrix >= storage_.matrix_count) refuse("a channel has no matrix");
  }
  const bool half = storage_.precision == Precision::kF16;
  const std::size_t basis = half ? storage_.basis_f16.size() : storage_.basis_f32.size();
  if (basis != tile_count(n) * rank * LowRankOperator::kTile)
    refuse("the basis has the wrong size");
  if (storage_.coupling.size() != storage_.matrix_count * rank * rank) {
    refuse("the coupling matrices have the wrong size");
  }
  sqrt_area_.reserve(n);
  for (const float area : storage_.area) sqrt_area_.push_back(std::sqrt(area));
  rank_stride_ = (rank + kVector - 1) / kVector * kVector;
}

std::size_t LowRankOperator::bytes() const {
  return storage_.basis_f32.size_bytes() + storage_.basis_f16.size_bytes() +
         storage_.coupling.size_bytes();
}

std::size_t LowRankOperator::bytes_per_apply() const {
  const std::size_t twice = storage_.basis_f32.size_bytes() + storage_.basis_f16.size_bytes();
  return 2 * twice + storage_.coupling.size_bytes();
}

std::size_t LowRankOperator::workspace_size() const {
  return kChannelCount * stride() + (tile_count(patch_count()) + 2) * coefficient_size();
}

void LowRankOperator::project_tile(std::size_t tile, const float* x,
                                   float* tile_coefficient) const {
  const BlockKernels& blocks = kernels().blocks;
  const BasisPart part = basis_of_tile(tile, storage_.rank);
  const PlanarVectors<const float> in{x, stride(), kChannelCount};
  const Coefficients<float> out{tile_coefficient + tile * coefficient_size(), coefficient_size()};
  if (storage_.precision == Precision::kF16) {
    blocks.bases_f16.project(storage_.basis_f16.data(), {&part, 1}, in, out);
  } else {
    blocks.bases_f32.project(storage_.basis_f32.data(), {&part, 1}, in, out);
  }
}

void LowRankOperator::add_up(const float* tile_coefficient, float* coefficient) const {
  std::fill_n(coefficient, coefficient_size(), 0.0F);
  for (std::size_t t = 0; t < tile_count(patch_count()); ++t) {
    const float* const part = tile_coefficient + t * coefficient_size();
    for (int c = 0; c < kChannelCount; ++c) {
      for (std::size_t r = 0; r < storage_.rank; ++r) {
        coefficient[c * rank_stride_ + r] += part[r * kChannelLanes + c];
      }
    }
  }
}

void LowRankOperator::multiply_row(std::size_t channel, std::size_t row, const float* in,
                                   float* out) const {
  const std::size_t rank = storage_.rank;
  const float* const coupling =
      storage_.coupling.data() + (storage_.channel_matrix[channel] * rank + row) * rank;
  const float* const x = in + channel * rank_stride_;
  // Neighbouring entries have separate sums, so that the compiler vectorises the loop.
  std::array<float, kVector> sum{};
  std::size_t j = 0;
  for (; j + kVector <= rank; j += kVector) {
    for (std::size_t v = 0; v < kVector; ++v) sum[v] += coupling[j + v] * x[j + v];
  }
  for (std::size_t v = 0; j + v < rank; ++v) sum[v] += coupling[j + v] * x[j + v];
  float total = 0;
  for (const float s : sum) total += s;
  out[row * kChannelLanes + channel] = total;
}

void LowRankOperator::expand_tile(std::size_t tile, const float* coefficient, float* y) const {
  const BlockKernels& blocks = kernels().blocks;
  const Coefficients<const float> in{coefficient, coefficient_size()};
  for (int c = 0; c < kChannelCount; ++c)
    std::fill_n(y + c * stride() + tile * LowRankOperator::kTile, LowRankOperator::kTile, 0.0F);
  const BasisPart part = basis_of_tile(tile, storage_.rank);
  const PlanarVectors<float> out{y, stride(), kChannelCount};
  if (storage_.precision == Precision::kF16) {
    blocks.bases_f16.expand(storage_.basis_f16.data(), {&part, 1}, in, out);
  } else {
    blocks.bases_f32.expand(storage_.basis_f32.data(), {&part, 1}, in, out);
  }
}

void LowRankOperator::do_apply(std::span<const Float3> initial_exitance,
                               std::span<Float3> indirect_irradiance, std::span<float> workspace,
                               const Scheduler& scheduler) const {
  const std::size_t n = patch_count();
  float* const x = workspace.data();
  float* const coefficient = x + kChannelCount * stride();
  float* const multiplied = coefficient + coefficient_size();
  for (int c = 0; c < kChannelCount; ++c) {
    float* const xc = x + c * stride();
    for (std::size_t i = 0; i < n; ++i) xc[i] = sqrt_area_[i] * initial_exitance[i][c];
    std::fill(xc + n, xc + stride(), 0.0F);
  }
  float* const tile_coefficient = multiplied + coefficient_size();
  const std::size_t tiles = tile_count(n), rank = storage_.rank, rows = kChannelCount * rank;
  const auto project = [&](std::size_t t) { project_tile(t, x, tile_coefficient); };
  const auto add = [&](std::size_t) { add_up(tile_coefficient, coefficient); };
  const auto multiply = [&](std::size_t k) {
    multiply_row(k / rank, k % rank, coefficient, multiplied);
  };
  const auto expand = [&](std::size_t t) { expand_tile(t, multiplied, x); };
  run_in_turn(scheduler, {{tiles, project},
                          {1, add},
                          {piece_count(rows, kRowsPerTask), on_piece(rows, kRowsPerTask, multiply)},
                          {tiles, expand}});
  for (std::size_t i = 0; i < n; ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      indirect_irradiance[i][c] = x[c * stride() + i] / sqrt_area_[i];
    }
  }
}

}  // namespace rebounce

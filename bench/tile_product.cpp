#include "bench/tile_product.h"

#include <omp.h>

#include <algorithm>
#include <cmath>

namespace rebounce::bench {
namespace {

constexpr std::size_t kTile = DenseOperator::kTile;

}  // namespace

TileProduct::TileProduct(const DenseOperator& transfer, const DenseKernels& kernels,
                         std::span<const Float3> initial_exitance)
    : transfer_(transfer),
      kernels_(kernels),
      side_((transfer.patch_count() + kTile - 1) / kTile),
      x_(kChannelCount * side_ * kTile),
      partial_(static_cast<std::size_t>(omp_get_max_threads()) * x_.size()) {
  for (std::size_t i = 0; i < initial_exitance.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      x_[c * side_ * kTile + i] = std::sqrt(transfer.storage().area[i]) * initial_exitance[i][c];
    }
  }
}

template <typename Value>
void TileProduct::run(const TileKernels<Value>& kernels, const Value* tiles) {
  const DenseOperator::Storage& storage = transfer_.storage();
  const std::size_t per_matrix = DenseOperator::tile_count(transfer_.patch_count());
  const auto multiply = [&](std::size_t matrix, std::size_t row, float* y) {
    const Value* tile = tiles + (matrix * per_matrix + row * (row + 1) / 2) * kTile * kTile;
    for (std::size_t column = 0; column <= row; ++column, tile += kTile * kTile) {
      for (int c = 0; c < kChannelCount; ++c) {
        if (storage.channel_matrix[c] != matrix) continue;
        const std::size_t at_row = (c * side_ + row) * kTile;
        const std::size_t at_column = (c * side_ + column) * kTile;
        if (row == column) {
          kernels.diagonal(tile, &x_[at_column], y + at_row);
        } else {
          kernels.off_diagonal(tile, &x_[at_column], &x_[at_row], y + at_row, y + at_column);
        }
      }
    }
  };
#pragma omp parallel
  {
    float* y = partial_.data() + static_cast<std::size_t>(omp_get_thread_num()) * x_.size();
    std::fill_n(y, x_.size(), 0.0F);
    // Long rows first, so that threads finish together.
#pragma omp for schedule(dynamic, 1)
    for (std::size_t k = 0; k < storage.matrix_count * side_; ++k) {
      multiply(k % storage.matrix_count, side_ - 1 - k / storage.matrix_count, y);
    }
  }
}

void TileProduct::run() {
  const DenseOperator::Storage& storage = transfer_.storage();
  if (storage.precision == Precision::kF16) {
    run(kernels_.f16, storage.tiles_f16.data());
  } else {
    run(kernels_.f32, storage.tiles_f32.data());
  }
}

std::vector<Float3> TileProduct::indirect_irradiance() const {
  const DenseOperator::Storage& storage = transfer_.storage();
  const float scale =
      storage.precision == Precision::kF16 ? 1.0F / DenseOperator::kHalfScale : 1.0F;
  std::vector<Float3> result(transfer_.patch_count());
  for (std::size_t i = 0; i < result.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      float sum = 0;
      for (std::size_t k = c * side_ * kTile + i; k < partial_.size(); k += x_.size()) {
        sum += partial_[k];
      }
      result[i][c] = sum * scale / std::sqrt(storage.area[i]);
    }
  }
  return result;
}

}  // namespace rebounce::bench

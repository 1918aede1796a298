#include "transfer/operator/dense_operator.h"

#include <algorithm>
#include <cmath>

#include "rebounce/error.h"
#include "transfer/base/finite_values.h"
#include "transfer/base/half_float.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {
namespace {

constexpr std::size_t kTile = DenseOperator::kTile;
constexpr std::size_t kTileSize = kTile * kTile;

// Partial sums go into this many slots for any number of threads. The order of additions, and so
// the bits of the result, never change.
constexpr std::size_t kSlotCount = 16;

std::size_t tiles_per_side(std::size_t patch_count) {
  return (patch_count + kTile - 1) / kTile;
}

std::size_t padded_size(std::size_t patch_count) {
  return tiles_per_side(patch_count) * kTile;
}

/// Which matrix each of three vectors is multiplied with.
using ChannelMatrices = std::array<std::uint32_t, kChannelCount>;

constexpr std::uint32_t kNoMatrix = UINT32_MAX;

/// Row and column of tile number `index` in the order (0,0) (1,0) (1,1) (2,0) ...
struct TilePosition {
  std::size_t row, column;

  explicit TilePosition(std::size_t index) {
    row = static_cast<std::size_t>((std::sqrt(8.0 * static_cast<double>(index) + 1.0) - 1.0) / 2.0);
    while (row * (row + 1) / 2 > index) --row;
    while ((row + 1) * (row + 2) / 2 <= index) ++row;
    column = index - row * (row + 1) / 2;
  }
  void advance() {
    if (column++ == row) {
      ++row;
      column = 0;
    }
  }
};

/// Adds the product of one tile with the planar vectors x [3][stride] to y [3][stride], for the
/// channels that use matrix `matrix`.
template <typename Value>
void apply_tile(const TileKernels<Value>& kernels, const Value* tile, const TilePosition& at,
                const ChannelMatrices& channel_matrix, std::uint32_t matrix, const float* x,
                float* y, std::size_t stride) {
  for (int channel = 0; channel < kChannelCount; ++channel) {
    if (channel_matrix[channel] != matrix) continue;
    const float* xc = x + channel * stride;
    float* yc = y + channel * stride;
    if (at.row == at.column) {
      kernels.diagonal(tile, xc + at.column * kTile, yc + at.row * kTile);
    } else {
      kernels.off_diagonal(tile, xc + at.column * kTile, xc + at.row * kTile, yc + at.row * kTile,
                           yc + at.column * kTile);
    }
  }
}

/// The tiles of one matrix that one slot multiplies, numbered within the matrix.
struct SlotPart {
  std::size_t begin, end;

  SlotPart(std::size_t slot, std::uint32_t matrix, std::size_t per_matrix, std::uint32_t matrices) {
    const std::size_t total = per_matrix * matrices, first = matrix * per_matrix;
    const auto within = [&](std::size_t k) {
      return std::clamp(k, first, first + per_matrix) - first;
    };
    begin = within(total * slot / kSlotCount);
    end = within(total * (slot + 1) / kSlotCount);
  }

  /// These tiles add to entries [0, extent) of y only: their last row ends there.
  std::size_t extent() const { return begin == end ? 0 : (TilePosition(end - 1).row + 1) * kTile; }
};

template <typename Value>
void apply_tiles(const TileKernels<Value>& kernels, const Value* tiles,
                 const DenseOperator::Storage& storage, const ChannelMatrices& channel_matrix,
                 const float* x, float* slots, std::size_t stride, const Scheduler& scheduler) {
  const std::size_t per_matrix = DenseOperator::tile_count(storage.area.size());
  parallel_for(scheduler, kSlotCount, [&](std::size_t slot) {
    float* y = slots + slot * kChannelCount * stride;
    for (std::uint32_t matrix = 0; matrix < storage.matrix_count; ++matrix) {
      const SlotPart part(slot, matrix, per_matrix, storage.matrix_count);
      if (part.begin == part.end) continue;
      for (int channel = 0; channel < kChannelCount; ++channel) {
        if (channel_matrix[channel] == matrix) {
          std::fill_n(y + channel * stride, part.extent(), 0.0F);
        }
      }
      const Value* tile = tiles + (matrix * per_matrix + part.begin) * kTileSize;
      TilePosition at(part.begin);
      for (std::size_t k = part.begin; k < part.end; ++k, at.advance(), tile += kTileSize) {
        apply_tile(kernels, tile, at, channel_matrix, matrix, x, y, stride);
      }
    }
  });
}

/// Adds up the slots of one of three vectors, in order, into sum [stride].
void add_slots(const DenseOperator::Storage& storage, int vector, std::uint32_t matrix,
               const float* slots, std::size_t stride, float* sum) {
  const std::size_t per_matrix = DenseOperator::tile_count(storage.area.size());
  std::fill_n(sum, stride, 0.0F);
  for (std::size_t slot = 0; slot < kSlotCount; ++slot) {
    const SlotPart part(slot, matrix, per_matrix, storage.matrix_count);
    const float* y = slots + (slot * kChannelCount + vector) * stride;
    const std::size_t extent = part.extent();
    for (std::size_t i = 0; i < extent; ++i) sum[i] += y[i];
  }
}

}  // namespace

std::size_t DenseOperator::tile_count(std::size_t patch_count) {
  const std::size_t side = tiles_per_side(patch_count);
  return side * (side + 1) / 2;
}

DenseOperator::DenseOperator(Storage storage) : storage_(std::move(storage)) {
  if (storage_.precision != Precision::kF16 && storage_.precision != Precision::kF32) {
    throw Error("dense operator: it has no bases to hold as integers; use f16 or f32");
  }
  const std::size_t values = storage_.matrix_count * tile_count(patch_count()) * kTileSize;
  const bool half = storage_.precision == Precision::kF16;
  if ((half ? storage_.tiles_f16.size() : storage_.tiles_f32.size()) != values) {
    throw Error("dense operator: the number of tiles does not fit the number of patches");
  }
  if (!are_finite(storage_.tiles_f32.span()) || !halves_are_finite(storage_.tiles_f16.span())) {
    throw Error("dense operator: a value is not finite");
  }
  for (const std::uint32_t matrix : storage_.channel_matrix) {
    if (matrix >= storage_.matrix_count) throw Error("dense operator: a channel has no matrix");
  }
  sqrt_area_.resize(patch_count());
  std::transform(storage_.area.begin(), storage_.area.end(), sqrt_area_.begin(),
                 [](float area) { return std::sqrt(area); });
}

std::size_t DenseOperator::bytes() const {
  return storage_.tiles_f16.size_bytes() + storage_.tiles_f32.size_bytes();
}

std::size_t DenseOperator::workspace_size() const {
  return (1 + kSlotCount) * kChannelCount * padded_size(patch_count());
}

void DenseOperator::do_apply(std::span<const Float3> initial_exitance,
                             std::span<Float3> indirect_irradiance, std::span<float> workspace,
                             const Scheduler& scheduler) const {
  const std::size_t n = patch_count(), stride = padded_size(n);
  float* const x = workspace.data();
  std::fill_n(x, kChannelCount * stride, 0.0F);
  for (std::size_t i = 0; i < n; ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      x[c * stride + i] = sqrt_area_[i] * initial_exitance[i][c];
    }
  }
  multiply(storage_.channel_matrix, workspace, scheduler);
  for (std::size_t i = 0; i < n; ++i) {
    for (int c = 0; c < kChannelCount; ++c) indirect_irradiance[i][c] = x[c * stride + i];
  }
}

void DenseOperator::do_apply_planes(std::optional<int> channel,
                                    std::span<const float> initial_exitance,
                                    std::span<float> indirect_irradiance,
                                    std::span<float> workspace, const Scheduler& scheduler) const {
  const std::size_t n = patch_count(), stride = padded_size(n);
  float* const x = workspace.data();
  for (std::size_t first = 0; first < initial_exitance.size(); first += kChannelCount * n) {
    const std::size_t planes =
        std::min(static_cast<std::size_t>(kChannelCount), (initial_exitance.size() - first) / n);
    std::fill_n(x, kChannelCount * stride, 0.0F);
    ChannelMatrices matrix;
    matrix.fill(kNoMatrix);
    for (std::size_t v = 0; v < planes; ++v) {
      matrix[v] = storage_.channel_matrix[channel ? *channel : v];
      const float* const plane = initial_exitance.data() + first + v * n;
      for (std::size_t i = 0; i < n; ++i) x[v * stride + i] = sqrt_area_[i] * plane[i];
    }
    multiply(matrix, workspace, scheduler);
    for (std::size_t v = 0; v < planes; ++v) {
      std::copy_n(x + v * stride, n, indirect_irradiance.data() + first + v * n);
    }
  }
}

void DenseOperator::multiply(const std::array<std::uint32_t, kChannelCount>& matrix,
                             std::span<float> workspace, const Scheduler& scheduler) const {
  const std::size_t n = patch_count(), stride = padded_size(n);
  float* const x = workspace.data();
  float* const slots = x + kChannelCount * stride;
  const bool half = storage_.precision == Precision::kF16;
  if (half) {
    apply_tiles(kernels().dense.f16, storage_.tiles_f16.data(), storage_, matrix, x, slots, stride,
                scheduler);
  } else {
    apply_tiles(kernels().dense.f32, storage_.tiles_f32.data(), storage_, matrix, x, slots, stride,
                scheduler);
  }
  const float scale = half ? 1.0F / kHalfScale : 1.0F;
  for (int v = 0; v < kChannelCount; ++v) {
    if (matrix[v] == kNoMatrix) continue;
    float* const sum = x + v * stride;  // x is no longer needed
    add_slots(storage_, v, matrix[v], slots, stride, sum);
    for (std::size_t i = 0; i < n; ++i) sum[i] = sum[i] * scale / sqrt_area_[i];
  }
}

float DenseOperator::symmetric_entry(std::uint32_t matrix, std::size_t row,
                                     std::size_t column) const {
  const std::size_t k = matrix * tile_count(patch_count()) * kTileSize + entry_index(row, column);
  return storage_.precision == Precision::kF16 ? half_to_float(storage_.tiles_f16[k]) / kHalfScale
                                               : storage_.tiles_f32[k];
}

void DenseOperator::do_expand(int channel, std::span<float> transfer) const {
  const std::size_t n = patch_count();
  const std::uint32_t matrix = storage_.channel_matrix[channel];
  parallel_for({}, n, [&](std::size_t i) {
    for (std::size_t j = 0; j < n; ++j) {
      transfer[i * n + j] = symmetric_entry(matrix, i, j) * sqrt_area_[j] / sqrt_area_[i];
    }
  });
}

std::vector<std::uint16_t> DenseOperator::encode_half(std::span<const float> tiles) {
  std::vector<std::uint16_t> half(tiles.size());
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    half[k] = float_to_half(tiles[k] * kHalfScale);
    if ((half[k] & 0x7FFFU) >= 0x7C00U) {
      throw Error("an entry of the operator is too large for f16; use --precision f32");
    }
  }
  return half;
}

}  // namespace rebounce

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "transfer/base/precision.h"
#include "transfer/base/shared_array.h"
#include "transfer/format/operator_format.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

/// Y as a dense matrix, in its symmetric form Yhat = A^1/2 Y A^-1/2 = G (I - rho G)^-1 with G =
/// A^1/2 F A^-1/2. Only the lower triangle of tiles is stored.
///
/// Tiles are kTile x kTile, row-major, and zero beyond patch n. A matrix is the sequence of its
/// tiles (0,0) (1,0) (1,1) (2,0) ...; a tile on the diagonal holds both of its halves. Channels
/// share one matrix if their reflectances are equal on all patches.
class DenseOperator final : public TransferOperator {
 public:
  static constexpr std::size_t kTile = kDenseTile;

  /// Half-precision tiles hold the entries times this factor, so that small entries stay normal
  /// numbers.
  static constexpr float kHalfScale = 1024;

  struct Storage {
    std::vector<float> area;                                    ///< [n] m²
    std::array<std::uint32_t, kChannelCount> channel_matrix{};  ///< which matrix each channel uses
    std::uint32_t matrix_count = 0;                             ///< 1, 2 or 3
    Precision precision = Precision::kF32;
    SharedArray<float> tiles_f32;          ///< [matrix_count][tile_count(n)][kTile][kTile], if kF32
    SharedArray<std::uint16_t> tiles_f16;  ///< the same as bits of IEEE halves, if kF16
  };

  /// The number of tiles of one matrix for n patches: t (t + 1) / 2 with t = ceil(n / kTile).
  static std::size_t tile_count(std::size_t patch_count);

  /// The index, within the tiles of a matrix, of the entry of two patches in either order.
  static std::size_t entry_index(std::size_t row, std::size_t column) {
    if (row < column) std::swap(row, column);
    const std::size_t tile_row = row / kTile;
    const std::size_t tile = tile_row * (tile_row + 1) / 2 + column / kTile;
    return (tile * kTile + row % kTile) * kTile + column % kTile;
  }

  /// Encodes tiles for Precision::kF16. Throws Error if an entry exceeds the range of half
  /// precision.
  static std::vector<std::uint16_t> encode_half(std::span<const float> tiles);

  /// Takes ownership of `storage`. Throws Error if its sizes do not agree.
  explicit DenseOperator(Storage storage);

  const Storage& storage() const { return storage_; }

  std::size_t patch_count() const override { return storage_.area.size(); }
  std::size_t bytes() const override;
  OperatorKind kind() const override { return OperatorKind::kDense; }
  std::size_t workspace_size() const override;

  /// Yhat(row, column) of one matrix.
  float symmetric_entry(std::uint32_t matrix, std::size_t row, std::size_t column) const;

 private:
  void do_apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
                std::span<float> workspace, const Scheduler& scheduler) const override;
  void do_apply_planes(std::optional<int> channel, std::span<const float> initial_exitance,
                       std::span<float> indirect_irradiance, std::span<float> workspace,
                       const Scheduler& scheduler) const override;
  void do_expand(int channel, std::span<float> transfer) const override;

  /// Overwrites the three vectors at the begin of the workspace, light times the root of the area,
  /// with what arrives; vector v with `matrix`[v].
  void multiply(const std::array<std::uint32_t, kChannelCount>& matrix, std::span<float> workspace,
                const Scheduler& scheduler) const;

  Storage storage_;
  std::vector<float> sqrt_area_;
};

}  // namespace rebounce

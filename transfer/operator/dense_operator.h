#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "transfer/base/precision.h"
#include "transfer/base/shared_array.h"
#include "transfer/format/operator_format.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

/// Y stored whole, in its symmetric form Yhat = A^1/2 Y A^-1/2 = G (I - rho G)^-1 with
/// G = A^1/2 F A^-1/2, of which only the lower triangle of tiles is kept.
///
/// Tiles are kTile x kTile, row-major, zero where they reach past patch n. A matrix is the sequence
/// of its tiles (0,0) (1,0) (1,1) (2,0) ...; both halves of a tile on the diagonal are filled.
/// Channels whose reflectances agree everywhere share one matrix.
class DenseOperator final : public TransferOperator {
 public:
  static constexpr std::size_t kTile = kDenseTile;

  /// Half-precision tiles hold the entries times this, so that small ones stay normal numbers.
  static constexpr float kHalfScale = 1024;

  struct Storage {
    std::vector<float> area;                                    ///< [n] m²
    std::array<std::uint32_t, kChannelCount> channel_matrix{};  ///< which matrix a channel uses
    std::uint32_t matrix_count = 0;                             ///< 1, 2 or 3
    Precision precision = Precision::kF32;
    SharedArray<float> tiles_f32;          ///< [matrix_count][tile_count(n)][kTile][kTile], if kF32
    SharedArray<std::uint16_t> tiles_f16;  ///< the same as IEEE half-precision bits, if kF16
  };

  /// Tiles of one matrix for n patches: t (t + 1) / 2 with t = ceil(n / kTile).
  static std::size_t tile_count(std::size_t patch_count);

  /// Where in the tiles of a matrix the entry of two patches is, in either order.
  static std::size_t entry_index(std::size_t row, std::size_t column) {
    if (row < column) std::swap(row, column);
    const std::size_t tile_row = row / kTile;
    const std::size_t tile = tile_row * (tile_row + 1) / 2 + column / kTile;
    return (tile * kTile + row % kTile) * kTile + column % kTile;
  }

  /// Encodes tiles for Precision::kF16. Throws Error if an entry is beyond half precision's range.
  static std::vector<std::uint16_t> encode_half(std::span<const float> tiles);

  /// Takes over `storage`. Throws Error if its sizes do not agree.
  explicit DenseOperator(Storage storage);

  const Storage& storage() const { return storage_; }

  std::size_t patch_count() const override { return storage_.area.size(); }
  std::size_t bytes() const override;
  std::string kind() const override { return "dense"; }
  std::size_t workspace_size() const override;
  void apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
             std::span<float> workspace, const Scheduler& scheduler = {}) const override;
  void expand(int channel, std::span<float> transfer) const override;

  /// Yhat(row, column) of one matrix.
  float symmetric_entry(std::uint32_t matrix, std::size_t row, std::size_t column) const;

 private:
  Storage storage_;
  std::vector<float> sqrt_area_;
};

}  // namespace rebounce

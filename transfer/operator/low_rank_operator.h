#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "transfer/base/precision.h"
#include "transfer/base/shared_array.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

/// Y with one low rank for the whole scene, in its symmetric form Yhat = A^1/2 Y A^-1/2 ~ V S V^T.
///
/// The channels share the basis V, whose columns are orthonormal. Each has its own symmetric
/// coupling matrix S.
class LowRankOperator final : public TransferOperator {
 public:
  /// Patches per tile of the basis; threads share the tiles.
  static constexpr std::size_t kTile = 256;

  struct Storage {
    std::vector<float> area;                                    ///< [n] m²
    std::array<std::uint32_t, kChannelCount> channel_matrix{};  ///< which matrix each channel uses
    std::uint32_t matrix_count = 0;                             ///< 1, 2 or 3
    std::size_t rank = 0;                                       ///< at most n
    Precision precision = Precision::kF32;                      ///< of the basis
    SharedArray<float> basis_f32;  ///< [tile_count(n)][rank][kTile], if kF32; zero past patch n
    SharedArray<std::uint16_t> basis_f16;  ///< the same as bits of IEEE halves, if kF16
    SharedArray<float> coupling;           ///< [matrix_count][rank][rank]
  };

  static std::size_t tile_count(std::size_t patch_count);

  /// The same operator with its basis in half precision.
  static Storage encode_half(const Storage& storage);

  /// Takes ownership of `storage`. Throws Error if its sizes do not agree.
  explicit LowRankOperator(Storage storage);

  const Storage& storage() const { return storage_; }

  std::size_t patch_count() const override { return storage_.area.size(); }
  std::size_t bytes() const override;
  /// The basis counts twice: an apply reads it to project light and to expand it.
  std::size_t bytes_per_apply() const override;
  OperatorKind kind() const override { return OperatorKind::kLowRank; }
  std::size_t workspace_size() const override;

 private:
  void do_apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
                std::span<float> workspace, const Scheduler& scheduler) const override;

  std::size_t stride() const { return tile_count(patch_count()) * kTile; }
  /// Floats for the coefficients of all channels, each rounded up to whole vectors.
  std::size_t coefficient_size() const { return (kChannelCount + 1) * rank_stride_; }
  /// Computes V^T x of one tile; add_up adds the results of all tiles into [coefficient_size()].
  void project_tile(std::size_t tile, const float* x, float* tile_coefficient) const;
  void add_up(const float* tile_coefficient, float* coefficient) const;
  /// Multiplies one row of the coupling matrix of a channel with `in`.
  void multiply_row(std::size_t channel, std::size_t row, const float* in, float* out) const;
  void expand_tile(std::size_t tile, const float* coefficient, float* y) const;

  Storage storage_;
  std::vector<float> sqrt_area_;  ///< [n]
  std::size_t rank_stride_ = 0;
};

}  // namespace rebounce

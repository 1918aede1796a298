#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rebounce/transfer/dense_operator.h"
#include "rebounce/transfer/shared_array.h"
#include "rebounce/transfer/transfer_operator.h"

namespace rebounce {

class HierarchicalPlan;
struct HierarchicalLayout;

/// A rectangle of the symmetric matrix Yhat in cluster order. Either it lies on the diagonal, its
/// rows and columns the same, or all of its columns come before its rows; then it stands for its
/// transpose too.
///
/// Large blocks are of low rank over *moments* instead of positions: the light of some positions in
/// a basis that all blocks over them share. A block of kMoments is such a basis. Moments are
/// numbered after the positions, and the rows and the columns of a low-rank block each are of one
/// kind.
struct TransferBlock {
  /// Of kMoments the rows are positions and the columns the moments that they have, in the order of
  /// the blocks.
  enum class Kind : std::uint32_t { kDense = 0, kLowRank = 1, kMoments = 2 };

  std::uint32_t row_begin = 0, row_count = 0;        ///< positions, multiples of kAlignment
  std::uint32_t column_begin = 0, column_count = 0;  ///< likewise
  Kind kind = Kind::kDense;
  /// Of a low-rank block; 0 for a dense one; of moments as many as columns, and 0.
  std::uint32_t row_rank = 0, column_rank = 0;
  /// So many of the first vectors of a basis are sums of two in 8 bits, which alone are too coarse
  /// for them: see kRemainderScale. In f32 they are told but not used; in f16 and 16 bits 0.
  std::uint32_t row_remainders = 0, column_remainders = 0;

  bool on_diagonal() const { return row_begin == column_begin; }

  /// Values that it takes up, for `matrix_count` distinct channels, without remainders.
  std::uint64_t value_count(std::uint32_t matrix_count) const;
};

/// Y as a hierarchical matrix (W. Hackbusch, "Hierarchical Matrices", 2015): the symmetric form
/// Yhat = A^1/2 Y A^-1/2, its patches in an order that keeps neighbours together, cut into blocks
/// that are dense or of low rank. Of a block and its mirror image one is stored and applied twice.
///
/// The channels share the bases of a low-rank block and have a core each: B_c = U S_c V^T, on the
/// diagonal B_c = U S_c U^T. Values of a block:
///   dense     [matrix][row_count][column_count]
///   low-rank  U^T [row_rank][row_count], V^T [column_rank][column_count] (not on the diagonal),
///             S [matrix][row_rank][column_rank]
///   moments   W^T [row_rank][row_count]
/// In 8 bits U^T, V^T and W^T have row_remainders and column_remainders rows more.
///
/// The bases of large blocks are nested (W. Hackbusch and S. Börm, "Data-sparse approximation by
/// adaptive H2-matrices", 2002), in one level: U = W D T, in which W has the bases of moments along
/// its diagonal, D their scales, and T, much shorter than U, is what the block holds.
///
/// An apply streams through the values: all bases of a cluster of patches are kept together,
/// whichever blocks they belong to, so that one pass over them takes the light of the cluster to
/// its coefficients, and another the coefficients back to the light that arrives.
///
/// Patches may be equilibrated: the values are then those of K, Yhat = R K R, in which R is
/// diagonal with powers of two, small for patches of whose light little arrives. Integers of a
/// basis have one step for all of its positions, and where it is dark they would be lost in it.
///
/// An operator for some receivers and sources has the blocks that these share, whichever way the
/// light goes; an apply reads them in the ways that are wanted.
class HierarchicalOperator final : public TransferOperator {
 public:
  /// Clusters begin and end at multiples of this many positions.
  static constexpr std::size_t kAlignment = 16;
  static constexpr std::size_t kPadding = 16;

  /// In half precision, dense entries and cores are stored times this, so that small ones stay
  /// normal numbers; bases are stored as they are. With orthonormal bases no core has an entry
  /// above the norm of Yhat, 1 / (1 - reflectance): up to 0.99, the most that patches have, all of
  /// them fit. Those of an equilibrated K are made to: encode_half.
  static constexpr float kHalfScale = 512;

  /// In 8 bits, a basis holds its vectors times numbers of their own such that their largest
  /// entries are +-127; cores are divided by them, with this for 1 at each end.
  static constexpr float kByteScale = 128;

  /// Vectors that bytes are too coarse for have a remainder: what rounding left of them, times
  /// this, as bytes again. Those of a basis follow its vectors, in their order.
  static constexpr float kRemainderScale = 254;

  /// In 16 bits likewise: the largest are +-kLargestShort, and kShortScale stands for 1. So few
  /// that sums of 128 products with such numbers fit 32 bits.
  static constexpr std::int16_t kLargestShort = 4095;
  static constexpr float kShortScale = 4096;

  /// Of the scales of positions.
  static constexpr int kLargestExponent = 24;

  /// Of bases in 16 bits, so many ranks are kept together, and so many positions.
  static constexpr std::uint32_t kRankGroup = 4, kStrip = 64;

  enum class Order : std::uint8_t {
    /// Block by block, U^T V^T S or the entries, without holes, then kPadding values not used.
    kByBlock,
    /// First the bases by cluster (begin ascending, then size descending), those of a cluster in
    /// the order of their blocks, U^T before V^T; then cores and dense entries by block, the
    /// matrices of an entry side by side; zeros to the next multiple of 64 values, at least
    /// kPadding of them. Bases in an array of their own are followed by zeros likewise. Integers
    /// are [strip][rank / kRankGroup][position / 2][kRankGroup][2 positions] in each cluster:
    /// strips of kStrip positions or what is left of it, the last ranks filled up with zeros.
    kStreamed,
  };

  struct Storage {
    std::vector<float> area;                                    ///< [n] m², by patch
    std::vector<std::uint32_t> patch;                           ///< [n] patch at each position
    std::array<std::uint32_t, kChannelCount> channel_matrix{};  ///< which matrix a channel uses
    std::uint32_t matrix_count = 0;                             ///< 1, 2 or 3
    std::vector<TransferBlock> blocks;                          ///< where there is none, Yhat is 0
    std::vector<float> moment_scale;  ///< [moments] times W^T x is a moment of light x
    /// [n] by position, R = 2^this, within +-kLargestExponent; none: R = 1.
    std::vector<std::int8_t> scale_exponent;
    PatchRoles roles;  ///< by patch; entries that no source and receiver share are of no meaning
    Order order = Order::kByBlock;  ///< of the values
    Precision precision = Precision::kF32;
    SharedArray<float> values_f32;          ///< if kF32
    SharedArray<std::uint16_t> values_f16;  ///< IEEE half-precision bits, if kF16
    SharedArray<std::int16_t> bases_q16;    ///< if kQ16; values_f16 then holds the others alone
    SharedArray<std::int8_t> bases_q8;      ///< if kQ8; likewise
  };

  /// Some of the patches, as `receivers` prepares them for `apply_to`.
  class Receivers {
   public:
    /// Values of the operator that an apply to them reads.
    std::uint64_t value_count() const;

   private:
    friend class HierarchicalOperator;
    explicit Receivers(std::shared_ptr<const HierarchicalPlan> plan) : plan_(std::move(plan)) {}
    std::shared_ptr<const HierarchicalPlan> plan_;
  };

  /// Positions with the padding that makes them whole vectors: n rounded up to kAlignment.
  static std::size_t position_count(std::size_t patch_count);

  /// The same operator with its values in the order kStreamed. A low-rank block that has only one
  /// rank loses it. Throws Error as the constructor does.
  static Storage stream(const Storage& storage);

  /// The same with half-precision numbers, in the order kStreamed. Where there are scales of
  /// positions, all of them grow as far as entries would be beyond the range of halves. Throws
  /// Error if the values are not in f32 or one is still beyond it, and as the constructor does.
  static Storage encode_half(const Storage& storage);

  /// The same with bases of 16 bits. Throws Error as encode_half does.
  static Storage encode_shorts(const Storage& storage);

  /// The same with bases of 8 bits, and the remainders that its blocks ask for. Throws Error as
  /// encode_half does.
  static Storage encode_bytes(const Storage& storage);

  /// Values in f32 as `precision` has them, in the order kStreamed. Throws Error if they are not in
  /// f32, and as the constructor and the encodings do.
  static Storage encode(const Storage& storage, Precision precision);

  /// Takes over `storage`; values in the order kByBlock are copied into the order kStreamed. Throws
  /// Error if `patch` is not a permutation, a block reaches outside the matrix, is misplaced or has
  /// a rank above its size, the values do not fit the blocks, or as check_roles does. Whether the
  /// blocks cover the matrix is not looked at.
  explicit HierarchicalOperator(Storage storage);

  const Storage& storage() const { return storage_; }

  std::size_t patch_count() const override { return storage_.area.size(); }
  std::size_t bytes() const override;
  /// Bases are read twice, to project light and to expand it.
  std::size_t bytes_per_apply() const override;
  std::string kind() const override { return "hierarchical"; }
  const PatchRoles& roles() const override { return storage_.roles; }
  std::size_t workspace_size() const override { return batch_workspace_size(1); }
  void apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
             std::span<float> workspace) const override;
  std::size_t batch_workspace_size(std::size_t light_count) const override;
  void apply_batch(std::size_t light_count, std::span<const Float3> initial_exitance,
                   std::span<Float3> indirect_irradiance,
                   std::span<float> workspace) const override;
  void expand(int channel, std::span<float> transfer) const override;

  /// Prepares applies to these patches alone, which read only the blocks that reach them or
  /// neighbours within a run of kAlignment positions. Those that are no receivers of the operator
  /// get 0. Allocates. Throws Error if a patch does not exist.
  Receivers receivers(std::span<const std::uint32_t> patches) const;

  /// Like `apply`, but writes the irradiance [n] of the receivers alone, the same as `apply` would
  /// up to rounding; that of the other patches is left as it is.
  void apply_to(const Receivers& receivers, std::span<const Float3> initial_exitance,
                std::span<Float3> indirect_irradiance, std::span<float> workspace) const;

 private:
  std::shared_ptr<const HierarchicalPlan> plan_to(const std::vector<bool>& wanted) const;
  void run(const HierarchicalPlan& plan, std::size_t light_count,
           std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
           std::span<float> workspace) const;

  Storage storage_;
  /// [n] by position: R A^1/2, 0 of patches that are no sources, and R A^-1/2 times the scale of
  /// the products.
  std::vector<float> gather_scale_, scatter_scale_;
  std::shared_ptr<const HierarchicalLayout> layout_;
  std::shared_ptr<const HierarchicalPlan> plan_;  ///< to all receivers
};

}  // namespace rebounce

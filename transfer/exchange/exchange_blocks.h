#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/exchange/relaxation.h"

namespace rebounce {

/// Sparse F that uses its symmetry: the exchange areas S = A F below the diagonal, by rows, in
/// blocks of eight consecutive columns. Each value is read once and used for S(i,j) and S(j,i). It
/// takes half the bytes of FormFactorBlocks.
///
/// Rows are divided among a fixed number of partial sums, which are added in order, for any number
/// of threads. Vectors are planes [3][plane_size()], zero beyond patch n.
class ExchangeBlocks final : public SweepableFormFactors {
 public:
  /// Rows per group of Gauss-Seidel.
  static constexpr std::size_t kGroup = FormFactorBlocks::kGroup;

  /// Partial sums that the rows are divided among.
  static constexpr std::size_t kSlotCount = 8;

  /// `area` has n entries in m². Throws Error if the sizes do not agree.
  ExchangeBlocks(const ExchangeMatrix& exchange, std::span<const float> area);

  std::size_t patch_count() const override { return area_.size(); }
  std::size_t bytes() const override;
  std::size_t workspace_size() const override {
    return (1 + kSlotCount) * kChannelCount * plane_size();
  }

  /// Sequential Gauss-Seidel in the order of the patches. Sweeps in one direction read S twice,
  /// sweeps in alternating directions once: see CompressedFormFactors::make_relaxation.
  std::unique_ptr<Relaxation> make_relaxation() const override;

  /// n, rounded up to whole blocks.
  std::size_t plane_size() const { return in_whole_blocks(patch_count()); }

  /// The blocks of one row: those with columns before the row's group, then those within it.
  struct Row {
    const FormFactorBlock* blocks;
    const std::uint32_t* position;
    std::size_t outside, inside;
  };
  Row row(std::size_t row) const;

  float area(std::size_t patch) const { return area_[patch]; }
  float diagonal(std::size_t patch) const { return diagonal_[patch]; }  ///< S(i,i), m²

 private:
  void do_gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                 const Scheduler& scheduler) const override;

  std::vector<float> area_, diagonal_;
  std::vector<std::uint64_t> row_begin_;  ///< [n + 1] index of a row's first block
  /// [n] index of a row's first block within its group; these blocks come last.
  std::vector<std::uint64_t> inside_begin_;
  std::vector<std::uint32_t> position_;  ///< [blocks] first column / kFormFactorBlock
  std::vector<FormFactorBlock> block_;   ///< [blocks]
  std::array<std::size_t, kSlotCount + 1> slot_row_{};  ///< first row of each partial sum
};

}  // namespace rebounce

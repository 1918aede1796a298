#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/exchange/relaxation.h"

namespace rebounce {

/// Sparse F by its symmetry: the exchange areas S = A F below the diagonal, by rows, in blocks of
/// eight consecutive columns. Each is read once and used twice, for S(i,j) and for S(j,i): half the
/// bytes of FormFactorBlocks for the same F.
///
/// Rows are shared out among a fixed number of sums whatever the number of threads, and these are
/// added up in order. Vectors are planes, [3][plane_size()], zero past patch n.
class ExchangeBlocks final : public SweepableFormFactors {
 public:
  /// Gauss-Seidel takes this many rows at a time.
  static constexpr std::size_t kGroup = FormFactorBlocks::kGroup;

  /// Sums among which rows are shared out.
  static constexpr std::size_t kSlotCount = 8;

  /// `area` has n entries in m². Throws Error if the sizes do not agree.
  ExchangeBlocks(const ExchangeMatrix& exchange, std::span<const float> area);

  std::size_t patch_count() const override { return area_.size(); }
  std::size_t bytes() const override;
  std::size_t workspace_size() const override {
    return (1 + kSlotCount) * kChannelCount * plane_size();
  }
  void gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
              const Scheduler& scheduler = {}) const override;

  /// Sequential Gauss-Seidel in the order of the patches. Sweeps in one direction read S twice,
  /// sweeps in alternating directions once: see CompressedFormFactors::make_relaxation.
  std::unique_ptr<Relaxation> make_relaxation() const override;

  /// n, rounded up to whole blocks.
  std::size_t plane_size() const { return in_whole_blocks(patch_count()); }

  /// The blocks of one row: those with columns below `row`'s group, then those inside of it.
  struct Row {
    const FormFactorBlock* blocks;
    const std::uint32_t* position;
    std::size_t outside, inside;
  };
  Row row(std::size_t row) const;

  float area(std::size_t patch) const { return area_[patch]; }
  float diagonal(std::size_t patch) const { return diagonal_[patch]; }  ///< S(i,i), m²

 private:
  std::vector<float> area_, diagonal_;
  std::vector<std::uint64_t> row_begin_;     ///< [n + 1] index of a row's first block
  std::vector<std::uint64_t> inside_begin_;  ///< [n] of its first block inside its group: the last
  std::vector<std::uint32_t> position_;      ///< [blocks] first column / kFormFactorBlock
  std::vector<FormFactorBlock> block_;       ///< [blocks]
  std::array<std::size_t, kSlotCount + 1> slot_row_{};  ///< where the rows of each sum begin
};

}  // namespace rebounce

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/relaxation.h"
#include "transfer/format/form_factor_block.h"

namespace rebounce {

/// Sparse F by rows, in blocks of eight consecutive columns: the fastest form for sweeps in one
/// direction.
///
/// Neighbours in space are neighbours in number, so the patches that a patch sees form long runs,
/// and most entries of a stored block are not zero. A block has 32 bytes of values and 4 of
/// position. A full block takes 4.5 bytes per form factor; an index for each would make it 8. The
/// eight values are one wide load.
///
/// Vectors are planes [3][plane_size()], one channel after another, zero beyond patch n.
class FormFactorBlocks final : public SweepableFormFactors {
 public:
  /// Rows per group of Gauss-Seidel: a multiple of kFormFactorBlock, so that a block lies entirely
  /// within a group or outside of it. Larger groups need fewer synchronisations but have a longer
  /// serial part.
  static constexpr std::size_t kGroup = 256;

  explicit FormFactorBlocks(const FormFactorRows& rows);

  /// Expands `exchange`. `area` has n entries in m². Throws Error if the sizes do not agree or
  /// `exchange` is empty.
  FormFactorBlocks(const ExchangeMatrix& exchange, std::span<const float> area);

  std::size_t patch_count() const override { return row_begin_.size() - 1; }
  std::size_t bytes() const override;
  std::size_t workspace_size() const override { return kChannelCount * plane_size(); }

  /// Exact sequential Gauss-Seidel in the order of the patches, on any number of threads. Rows are
  /// relaxed in groups of kGroup. The part of a row outside the group is gathered in parallel, the
  /// part within it serially. Each group costs two synchronisations and a serial part of kGroup²
  /// form factors; convergence is unchanged.
  std::unique_ptr<Relaxation> make_relaxation() const override;

  /// n, rounded up to whole blocks.
  std::size_t plane_size() const { return in_whole_blocks(patch_count()); }

  /// Gathers one row from planes: all columns, those outside the row's group, those within it.
  Float3 gather_row(std::size_t row, std::span<const float> planes) const;
  Float3 gather_outside_group(std::size_t row, std::span<const float> planes) const;
  Float3 gather_inside_group(std::size_t row, std::span<const float> planes) const;

 private:
  void do_gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                 const Scheduler& scheduler) const override;

  Float3 gather_range(std::uint64_t begin, std::uint64_t end, std::span<const float> planes) const;

  void fill_row(const FormFactorRows& rows, std::size_t row);

  std::vector<std::uint64_t> row_begin_;  ///< [n + 1] index of a row's first block
  /// [n] index of a row's first block within its group; these blocks come last.
  std::vector<std::uint64_t> inside_begin_;
  std::vector<std::uint32_t> position_;  ///< [blocks] first column / kFormFactorBlock
  std::vector<FormFactorBlock> block_;   ///< [blocks]
};

}  // namespace rebounce

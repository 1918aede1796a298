#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/relaxation.h"
#include "transfer/format/form_factor_block.h"

namespace rebounce {

/// Sparse F by rows, in blocks of eight consecutive columns: the form that iterates fastest.
///
/// Patches that are neighbours in space are neighbours in number, so what a patch sees comes in
/// long runs, and a block that has one non-zero has most of them. A block is 32 bytes of values and
/// 4 of position: 4.5 bytes per form factor when full, against 8 with an index each, and the eight
/// are one wide load instead of eight scattered ones.
///
/// Vectors are "planes": [3][plane_size()], one channel after another, zero past patch n.
class FormFactorBlocks final : public SweepableFormFactors {
 public:
  /// Gauss-Seidel takes this many rows at a time: a multiple of the block, so that a block is
  /// wholly inside or outside a group. More: fewer synchronisations, a longer serial part.
  static constexpr std::size_t kGroup = 256;

  explicit FormFactorBlocks(const FormFactorRows& rows);

  /// Expands `exchange`; `area` has n entries in m². Throws Error if the sizes do not agree.
  FormFactorBlocks(const ExchangeMatrix& exchange, std::span<const float> area);

  std::size_t patch_count() const override { return row_begin_.size() - 1; }
  std::size_t bytes() const override;
  std::size_t workspace_size() const override { return kChannelCount * plane_size(); }
  void gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
              const Scheduler& scheduler = {}) const override;

  /// Sequential Gauss-Seidel in the order of the patches, to the letter, on any number of threads:
  /// rows are taken in groups of kGroup; what they gather from outside the group is found in
  /// parallel, what they gather from each other one after another. That costs two synchronisations
  /// and a serial part of kGroup² form factors per group, and nothing in convergence.
  std::unique_ptr<Relaxation> make_relaxation() const override;

  /// The part of the values that is not zero: 1 when every block is full.
  double fill() const;

  /// n, rounded up to whole blocks.
  std::size_t plane_size() const { return in_whole_blocks(patch_count()); }

  /// Copies [n][3] into planes, and back.
  void to_planes(std::span<const Float3> values, std::span<float> planes) const;
  void from_planes(std::span<const float> planes, std::span<Float3> values) const;

  /// Gathers one row from planes: all columns; those outside the row's group; those inside.
  Float3 gather_row(std::size_t row, std::span<const float> planes) const;
  Float3 gather_outside_group(std::size_t row, std::span<const float> planes) const;
  Float3 gather_inside_group(std::size_t row, std::span<const float> planes) const;

 private:
  Float3 gather_range(std::uint64_t begin, std::uint64_t end, std::span<const float> planes) const;

  void fill_row(const FormFactorRows& rows, std::size_t row);

  std::vector<std::uint64_t> row_begin_;     ///< [n + 1] index of a row's first block
  std::vector<std::uint64_t> inside_begin_;  ///< [n] of its first block inside its group: the last
  std::vector<std::uint32_t> position_;      ///< [blocks] first column / kFormFactorBlock
  std::vector<FormFactorBlock> block_;       ///< [blocks]
  std::uint64_t entry_count_ = 0;
};

}  // namespace rebounce

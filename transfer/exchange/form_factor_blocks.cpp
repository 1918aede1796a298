#include "transfer/exchange/form_factor_blocks.h"

#include <array>

#include "transfer/exchange/planes.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlockRowsPerTask = 64;

constexpr std::uint32_t position_of(std::size_t column) {
  return static_cast<std::uint32_t>(column / kFormFactorBlock);
}

bool same_group(std::size_t row, std::size_t column) {
  return row / FormFactorBlocks::kGroup == column / FormFactorBlocks::kGroup;
}

/// Counts the blocks of `row`: outside its group, and within it.
std::array<std::uint64_t, 2> count_blocks(std::span<const std::uint32_t> columns, std::size_t row) {
  std::array<std::uint64_t, 2> count{0, 0};
  std::uint32_t last = kNone;
  for (const std::uint32_t j : columns) {
    if (position_of(j) != last) ++count[same_group(row, j)];
    last = position_of(j);
  }
  return count;
}

}  // namespace

static_assert(FormFactorBlocks::kGroup % kFormFactorBlock == 0);

FormFactorBlocks::FormFactorBlocks(const ExchangeMatrix& exchange, std::span<const float> area)
    : FormFactorBlocks(FormFactorRows(exchange, area)) {}

FormFactorBlocks::FormFactorBlocks(const FormFactorRows& rows) {
  const std::size_t n = rows.patch_count();
  row_begin_.assign(n + 1, 0);
  inside_begin_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto [outside, inside] = count_blocks(rows.columns(i), i);
    inside_begin_[i] = row_begin_[i] + outside;
    row_begin_[i + 1] = inside_begin_[i] + inside;
  }
  position_.resize(row_begin_[n]);
  block_.resize(row_begin_[n]);
  for (std::size_t i = 0; i < n; ++i) fill_row(rows, i);
}

void FormFactorBlocks::fill_row(const FormFactorRows& rows, std::size_t row) {
  const auto columns = rows.columns(row);
  std::array<std::uint64_t, 2> next{row_begin_[row], inside_begin_[row]};
  std::uint32_t last = kNone;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    std::uint64_t& end = next[same_group(row, columns[k])];
    if (position_of(columns[k]) != last) position_[end++] = last = position_of(columns[k]);
    block_[end - 1].value[columns[k] % kFormFactorBlock] = rows.form_factors(row)[k];
  }
}

std::size_t FormFactorBlocks::bytes() const {
  return (row_begin_.size() + inside_begin_.size()) * sizeof(std::uint64_t) +
         position_.size() * sizeof(position_[0]) + block_.size() * sizeof(block_[0]);
}

void FormFactorBlocks::do_gather(std::span<const Float3> in, std::span<Float3> out,
                                 std::span<float> workspace, const Scheduler& scheduler) const {
  const std::span<float> planes = workspace.first(kChannelCount * plane_size());
  to_planes(in, plane_size(), planes.data());
  parallel_for_pieces(scheduler, patch_count(), kBlockRowsPerTask,
                      [&](std::size_t i) { out[i] = gather_row(i, planes); });
}

Float3 FormFactorBlocks::gather_range(std::uint64_t begin, std::uint64_t end,
                                      std::span<const float> planes) const {
  Float3 sum{0, 0, 0};
  kernels().gather.gather(block_.data() + begin, position_.data() + begin, end - begin,
                          planes.data(), plane_size(), sum.data());
  return sum;
}

Float3 FormFactorBlocks::gather_row(std::size_t row, std::span<const float> planes) const {
  return gather_range(row_begin_[row], row_begin_[row + 1], planes);
}

Float3 FormFactorBlocks::gather_outside_group(std::size_t row,
                                              std::span<const float> planes) const {
  return gather_range(row_begin_[row], inside_begin_[row], planes);
}

Float3 FormFactorBlocks::gather_inside_group(std::size_t row, std::span<const float> planes) const {
  return gather_range(inside_begin_[row], row_begin_[row + 1], planes);
}

}  // namespace rebounce

#include "rebounce/transfer/form_factor_blocks.h"

#include <algorithm>
#include <cassert>

#include "gather_kernels.h"

namespace rebounce {
namespace {

constexpr std::uint32_t position_of(std::size_t column) {
  return static_cast<std::uint32_t>(column / kFormFactorBlock);
}

}  // namespace

static_assert(FormFactorBlocks::kGroup % kFormFactorBlock == 0);

FormFactorBlocks::FormFactorBlocks(const ExchangeMatrix& exchange, std::span<const float> area)
    : FormFactorBlocks(FormFactorRows(exchange, area)) {}

FormFactorBlocks::FormFactorBlocks(const FormFactorRows& rows) {
  const std::size_t n = rows.patch_count();
  row_begin_.assign(n + 1, 0);
  group_range_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint32_t last = kNone;
    row_begin_[i + 1] = row_begin_[i];
    for (const std::uint32_t j : rows.columns(i)) {
      if (position_of(j) != last) ++row_begin_[i + 1];
      last = position_of(j);
    }
    entry_count_ += rows.columns(i).size();
  }
  position_.resize(row_begin_[n]);
  block_.resize(row_begin_[n]);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t k = row_begin_[i];
    std::uint32_t last = kNone;
    for (std::size_t e = 0; e < rows.columns(i).size(); ++e) {
      const std::uint32_t j = rows.columns(i)[e];
      if (last != kNone && position_of(j) != last) ++k;
      last = position_of(j);
      position_[k] = last;
      block_[k].value[j % kFormFactorBlock] = rows.form_factors(i)[e];
    }
    const auto first = position_.begin() + static_cast<std::ptrdiff_t>(row_begin_[i]);
    const auto end = position_.begin() + static_cast<std::ptrdiff_t>(row_begin_[i + 1]);
    const std::size_t group = i / kGroup * kGroup;
    const auto inside = [&](std::size_t column) {
      return static_cast<std::uint64_t>(std::lower_bound(first, end, position_of(column)) -
                                        position_.begin());
    };
    group_range_[i] = {inside(group), inside(group + kGroup)};
  }
}

std::size_t FormFactorBlocks::bytes() const {
  return row_begin_.size() * sizeof(row_begin_[0]) + position_.size() * sizeof(position_[0]) +
         block_.size() * sizeof(block_[0]);
}

double FormFactorBlocks::fill() const {
  return block_.empty() ? 1
                        : static_cast<double>(entry_count_) /
                              static_cast<double>(block_.size() * kFormFactorBlock);
}

void FormFactorBlocks::to_planes(std::span<const Float3> values, std::span<float> planes) const {
  const std::size_t n = patch_count(), stride = plane_size();
  assert(values.size() == n && planes.size() >= kChannelCount * stride);
  for (int c = 0; c < kChannelCount; ++c) {
    float* plane = planes.data() + c * stride;
    for (std::size_t i = 0; i < n; ++i) plane[i] = values[i][c];
    std::fill(plane + n, plane + stride, 0.0F);
  }
}

void FormFactorBlocks::from_planes(std::span<const float> planes, std::span<Float3> values) const {
  const std::size_t n = patch_count(), stride = plane_size();
  assert(values.size() == n && planes.size() >= kChannelCount * stride);
  for (std::size_t i = 0; i < n; ++i) {
    for (int c = 0; c < kChannelCount; ++c) values[i][c] = planes[c * stride + i];
  }
}

void FormFactorBlocks::gather(std::span<const Float3> in, std::span<Float3> out,
                              std::span<float> workspace) const {
  assert(out.size() == patch_count() && workspace.size() >= workspace_size());
  const std::span<float> planes = workspace.first(kChannelCount * plane_size());
  to_planes(in, planes);
  const auto n = static_cast<std::int64_t>(patch_count());
#pragma omp parallel for schedule(dynamic, 64)
  for (std::int64_t i = 0; i < n; ++i) out[i] = gather_row(i, planes);
}

Float3 FormFactorBlocks::gather_range(std::uint64_t begin, std::uint64_t end,
                                      std::span<const float> planes) const {
  Float3 sum{0, 0, 0};
  gather_kernels().gather(block_.data() + begin, position_.data() + begin, end - begin,
                          planes.data(), plane_size(), sum.data());
  return sum;
}

Float3 FormFactorBlocks::gather_row(std::size_t row, std::span<const float> planes) const {
  return gather_range(row_begin_[row], row_begin_[row + 1], planes);
}

Float3 FormFactorBlocks::gather_outside_group(std::size_t row,
                                              std::span<const float> planes) const {
  const Float3 before = gather_range(row_begin_[row], group_range_[row].begin, planes);
  const Float3 after = gather_range(group_range_[row].end, row_begin_[row + 1], planes);
  return {before[0] + after[0], before[1] + after[1], before[2] + after[2]};
}

Float3 FormFactorBlocks::gather_inside_group(std::size_t row, std::span<const float> planes) const {
  return gather_range(group_range_[row].begin, group_range_[row].end, planes);
}

void FormFactorBlocks::shoot(std::size_t row, const Float3& power, std::span<const float> scale,
                             std::span<float> planes) const {
  const std::uint64_t begin = row_begin_[row];
  gather_kernels().shoot(block_.data() + begin, position_.data() + begin,
                         row_begin_[row + 1] - begin, power.data(), scale.data(), planes.data(),
                         plane_size());
}

std::size_t FormFactorBlocks::largest(std::span<const float> planes) const {
  return gather_kernels().largest(planes.data(), plane_size());
}

}  // namespace rebounce

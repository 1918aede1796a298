#include "transfer/exchange/exchange_blocks.h"

#include <algorithm>
#include <limits>

#include "transfer/exchange/planes.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {

constexpr std::size_t kAddedPerTask = 1024;  // patches

ExchangeBlocks::ExchangeBlocks(const ExchangeMatrix& exchange, std::span<const float> area)
    : area_(area.begin(), area.end()), diagonal_(area.size(), 0.0F) {
  const FormFactorRows rows(exchange, area);
  const std::size_t n = area.size();
  row_begin_ = {0};
  for (std::size_t i = 0; i < n; ++i) {
    const auto columns = rows.columns(i);
    const std::size_t group_begin = i / kGroup * kGroup;
    std::uint32_t last = kNone;
    inside_begin_.push_back(std::numeric_limits<std::uint64_t>::max());
    for (std::size_t k = 0; k < columns.size() && columns[k] <= i; ++k) {
      const float exchange_area = rows.form_factors(i)[k] * area[i];
      if (columns[k] == i) {
        diagonal_[i] = exchange_area;
        continue;
      }
      const auto position = static_cast<std::uint32_t>(columns[k] / kFormFactorBlock);
      if (columns[k] >= group_begin) {
        inside_begin_[i] = std::min<std::uint64_t>(inside_begin_[i], position_.size());
      }
      if (position != last) {
        position_.push_back(last = position);
        block_.emplace_back();
      }
      block_.back().value[columns[k] % kFormFactorBlock] = exchange_area;
    }
    inside_begin_[i] = std::min<std::uint64_t>(inside_begin_[i], position_.size());
    row_begin_.push_back(position_.size());
  }
  for (std::size_t s = 0; s <= kSlotCount; ++s) {
    const std::uint64_t share = position_.size() * s / kSlotCount;
    slot_row_[s] =
        static_cast<std::size_t>(std::ranges::lower_bound(row_begin_, share) - row_begin_.begin());
  }
  slot_row_[kSlotCount] = n;
}

std::size_t ExchangeBlocks::bytes() const {
  return (row_begin_.size() + inside_begin_.size()) * sizeof(std::uint64_t) +
         position_.size() * sizeof(position_[0]) + block_.size() * sizeof(block_[0]) +
         (area_.size() + diagonal_.size()) * sizeof(float);
}

ExchangeBlocks::Row ExchangeBlocks::row(std::size_t row) const {
  const auto begin = static_cast<std::size_t>(row_begin_[row]);
  const auto inside = static_cast<std::size_t>(inside_begin_[row]);
  const auto end = static_cast<std::size_t>(row_begin_[row + 1]);
  return {block_.data() + begin, position_.data() + begin, inside - begin, end - inside};
}

void ExchangeBlocks::do_gather(std::span<const Float3> in, std::span<Float3> out,
                               std::span<float> workspace, const Scheduler& scheduler) const {
  const std::size_t n = patch_count(), stride = plane_size(), planes = kChannelCount * stride;
  float* const x = workspace.data();
  to_planes(in, stride, x);
  const auto gather_slot = [&](std::size_t s) {
    float* const y = x + (1 + s) * planes;
    std::fill_n(y, planes, 0.0F);
    for (std::size_t i = slot_row_[s]; i < slot_row_[s + 1]; ++i) {
      const Row blocks = row(i);
      Float3 sum;
      kernels().gather.gather_and_spread(blocks.blocks, blocks.position,
                                         blocks.outside + blocks.inside, in[i].data(), x, y, stride,
                                         sum.data());
      for (int c = 0; c < kChannelCount; ++c) y[c * stride + i] += sum[c] + diagonal_[i] * in[i][c];
    }
  };
  const auto add_up = [&](std::size_t i) {
    for (int c = 0; c < kChannelCount; ++c) {
      float sum = 0;
      for (std::size_t s = 0; s < kSlotCount; ++s) sum += x[(1 + s) * planes + c * stride + i];
      out[i][c] = sum / area_[i];
    }
  };
  run_in_turn(scheduler, {{kSlotCount, gather_slot},
                          {piece_count(n, kAddedPerTask), on_piece(n, kAddedPerTask, add_up)}});
}

}  // namespace rebounce

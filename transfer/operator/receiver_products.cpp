#include "transfer/operator/receiver_products.h"

#include "transfer/format/channel_lanes.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {
namespace {

constexpr std::size_t kSetsPerTask = 1024, kGroupsPerTask = 4;

}  // namespace

ReceiverProducts::ReceiverProducts(const ReceiverRows& rows, std::span<const float> area)
    : rows_(&rows), area_(area) {
  if (rows.empty()) return;
  flux_.resize(rows.patch.size() + 1);
  set_light_.resize(rows.set.size());
  std::vector<double> before(rows.patch.size() + 1, 0.0);
  for (std::size_t k = 0; k < rows.patch.size(); ++k) {
    before[k + 1] = before[k] + static_cast<double>(area[rows.patch[k]]);
  }
  for (const auto& [begin, end] : rows.set) {
    const double covered = before[end] - before[begin];  // 0 where the sum loses a tiny area
    inverse_area_.push_back(covered > 0 ? 1 / covered : 0);
  }
}

void ReceiverProducts::add(std::span<const Float3> radiosity, std::span<Float3> irradiance,
                           const Scheduler& scheduler) {
  if (rows_->empty()) return;
  average_sets(radiosity, scheduler);
  parallel_for_pieces(scheduler, rows_->group_count(), kGroupsPerTask,
                      [&](std::size_t g) { add_group(g, irradiance); });
}

void ReceiverProducts::average_sets(std::span<const Float3> radiosity, const Scheduler& scheduler) {
  for (std::size_t k = 0; k < rows_->patch.size(); ++k) {
    const std::uint32_t i = rows_->patch[k];
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      flux_[k + 1][c] = flux_[k][c] + static_cast<double>(area_[i]) * radiosity[i][c];
    }
  }
  parallel_for_pieces(scheduler, set_light_.size(), kSetsPerTask, [&](std::size_t k) {
    const auto [begin, end] = rows_->set[k];
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      set_light_[k][c] = static_cast<float>((flux_[end][c] - flux_[begin][c]) * inverse_area_[k]);
    }
  });
}

void ReceiverProducts::add_group(std::size_t group, std::span<Float3> irradiance) const {
  constexpr std::size_t kSize = ReceiverRows::kGroup;
  const std::size_t first = rows_->group_begin[group];
  const std::size_t count = rows_->group_begin[group + 1] - first;
  if (count == 0) return;
  std::array<float, ReceiverRows::kMostSets * kChannelLanes> coefficient;
  for (std::size_t j = 0; j < count; ++j) {
    const auto& light = set_light_[rows_->entry_set[first + j]];
    const float scale = rows_->scale[first + j];
    float* const to = coefficient.data() + j * kChannelLanes;
    for (std::size_t c = 0; c < kChannelCount; ++c) to[c] = scale * light[c];
    to[kChannelCount] = 0;
  }
  std::array<float, kChannelCount * kSize> sum{};
  BasisPart part{};
  part.values = first * kSize;
  part.rank = part.last_rank = static_cast<std::uint32_t>(count);
  part.size = part.last_offset = kSize;
  kernels().blocks.bases_q8.expand(rows_->value.data(), {&part, 1}, {coefficient.data(), 0},
                                   {sum.data(), kSize, kChannelCount});
  for (std::size_t i = 0; i < kSize; ++i) {
    const std::uint32_t v = rows_->receiver[group * kSize + i];
    if (v == kNone) continue;
    for (std::size_t c = 0; c < kChannelCount; ++c) irradiance[v][c] += sum[c * kSize + i];
  }
}

}  // namespace rebounce

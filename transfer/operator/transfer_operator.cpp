#include "transfer/operator/transfer_operator.h"

#include <algorithm>
#include <string>

#include "rebounce/error.h"
#include "transfer/base/argument_check.h"

namespace rebounce {
namespace {

// lab/078: to read fewer bytes takes one thread less time than to start others.
constexpr std::size_t kSmallProductBytes = 256 * 1024;

// All tasks on the calling thread.
constexpr Scheduler kCallingThread{
    [](void* /*user*/, std::uint32_t count, Scheduler::Task task, void* context) {
      for (std::uint32_t i = 0; i < count; ++i) task(context, i);
    }};

void check_channel(int channel) {
  if (channel < 0 || channel >= kChannelCount) {
    throw Error("operator: there is no channel " + std::to_string(channel));
  }
}

}  // namespace

Scheduler TransferOperator::scheduler_for(std::size_t light_count,
                                          const Scheduler& scheduler) const {
  const bool starts_threads = scheduler.parallel_for == nullptr;
  const bool alone = starts_threads && light_count * bytes_per_apply() < kSmallProductBytes;
  return alone ? kCallingThread : scheduler;
}

const PatchRoles& TransferOperator::roles() const {
  static const PatchRoles all_both;
  return all_both;
}

std::size_t TransferOperator::batch_workspace_size(std::size_t) const {
  return workspace_size();
}

void TransferOperator::apply(std::span<const Float3> initial_exitance,
                             std::span<Float3> indirect_irradiance, std::span<float> workspace,
                             const Scheduler& scheduler) const {
  check_size("operator: initial exitance", initial_exitance.size(), patch_count());
  check_size("operator: indirect irradiance", indirect_irradiance.size(), patch_count());
  check_workspace("operator: workspace", workspace.size(), workspace_size());
  do_apply(initial_exitance, indirect_irradiance, workspace, scheduler_for(1, scheduler));
}

void TransferOperator::apply_batch(std::size_t light_count,
                                   std::span<const Float3> initial_exitance,
                                   std::span<Float3> indirect_irradiance,
                                   std::span<float> workspace, const Scheduler& scheduler) const {
  const std::size_t size = light_count * patch_count();
  check_size("operator: initial exitance", initial_exitance.size(), size);
  check_size("operator: indirect irradiance", indirect_irradiance.size(), size);
  check_workspace("operator: workspace", workspace.size(), batch_workspace_size(light_count));
  do_apply_batch(light_count, initial_exitance, indirect_irradiance, workspace,
                 scheduler_for(light_count, scheduler));
}

void TransferOperator::apply_planes(std::optional<int> channel,
                                    std::span<const float> initial_exitance,
                                    std::span<float> indirect_irradiance,
                                    std::span<float> workspace, const Scheduler& scheduler) const {
  if (initial_exitance.empty()) return;
  if (channel) check_channel(*channel);
  const std::size_t of_light = patch_count() * (channel ? 1 : kChannelCount);
  const std::size_t whole = initial_exitance.size() / std::max<std::size_t>(of_light, 1) * of_light;
  check_size("operator: planes of initial exitance", initial_exitance.size(), whole);
  check_size("operator: planes of indirect irradiance", indirect_irradiance.size(), whole);
  const std::size_t lights = piece_count(whole / patch_count(), kChannelCount);
  check_workspace("operator: workspace", workspace.size(), batch_workspace_size(lights));
  do_apply_planes(channel, initial_exitance, indirect_irradiance, workspace,
                  scheduler_for(lights, scheduler));
}

void TransferOperator::expand(int channel, std::span<float> transfer) const {
  check_channel(channel);
  check_size("operator: expanded matrix", transfer.size(), patch_count() * patch_count());
  do_expand(channel, transfer);
}

void TransferOperator::do_apply_batch(std::size_t light_count,
                                      std::span<const Float3> initial_exitance,
                                      std::span<Float3> indirect_irradiance,
                                      std::span<float> workspace,
                                      const Scheduler& scheduler) const {
  const std::size_t n = patch_count();
  for (std::size_t light = 0; light < light_count; ++light) {
    do_apply(initial_exitance.subspan(light * n, n), indirect_irradiance.subspan(light * n, n),
             workspace, scheduler);
  }
}

void TransferOperator::do_apply_planes(std::optional<int> channel,
                                       std::span<const float> initial_exitance,
                                       std::span<float> indirect_irradiance,
                                       std::span<float> workspace,
                                       const Scheduler& scheduler) const {
  const std::size_t n = patch_count();
  std::vector<Float3> light(n), result(n);
  const std::size_t first = channel.value_or(0), count = channel ? 1 : kChannelCount;
  for (std::size_t at = 0; at < initial_exitance.size(); at += count * n) {
    for (std::size_t v = 0; v < count; ++v) {
      for (std::size_t i = 0; i < n; ++i) light[i][first + v] = initial_exitance[at + v * n + i];
    }
    do_apply(light, result, workspace, scheduler);
    for (std::size_t v = 0; v < count; ++v) {
      for (std::size_t i = 0; i < n; ++i)
        indirect_irradiance[at + v * n + i] = result[i][first + v];
    }
  }
}

void TransferOperator::do_expand(int channel, std::span<float> transfer) const {
  const std::size_t n = patch_count();
  std::vector<Float3> unit(n, {0, 0, 0}), column(n);
  std::vector<float> workspace(workspace_size());
  for (std::size_t j = 0; j < n; ++j) {
    unit[j][channel] = 1;
    do_apply(unit, column, workspace, {});
    unit[j][channel] = 0;
    for (std::size_t i = 0; i < n; ++i) transfer[i * n + j] = column[i][channel];
  }
}

std::vector<Float3> product(const TransferOperator& transfer,
                            std::span<const Float3> initial_exitance) {
  std::vector<Float3> indirect_irradiance(initial_exitance.size());
  std::vector<float> workspace(transfer.workspace_size());
  transfer.apply(initial_exitance, indirect_irradiance, workspace);
  return indirect_irradiance;
}

}  // namespace rebounce

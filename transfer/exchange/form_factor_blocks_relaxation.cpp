#include <algorithm>

#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/exchange/planes.h"

namespace rebounce {
namespace {

constexpr std::size_t kBlockRowsPerSweepTask = 16;

class BlockRowRelaxation final : public Relaxation {
 public:
  explicit BlockRowRelaxation(const FormFactorBlocks& blocks)
      : blocks_(blocks),
        planes_(kChannelCount * blocks.plane_size()),
        outside_(FormFactorBlocks::kGroup) {}

  void begin(const RelaxationProblem& problem, std::span<const Float3> radiosity) override {
    problem_ = problem;
    to_planes(radiosity, blocks_.plane_size(), planes_.data());
  }

  double sweep(SweepDirection direction, const Scheduler& scheduler) override {
    const std::size_t n = blocks_.patch_count(),
                      group_count = (n + FormFactorBlocks::kGroup - 1) / FormFactorBlocks::kGroup;
    const bool backward = direction == SweepDirection::kBackward;
    double changed_squared = 0;
    for (std::size_t k = 0; k < group_count; ++k) {
      const std::size_t group = backward ? group_count - 1 - k : k;
      const std::size_t begin = group * FormFactorBlocks::kGroup,
                        end = std::min(begin + FormFactorBlocks::kGroup, n);
      gather_from_outside(begin, end, scheduler);
      changed_squared += relax_group(begin, end, backward);
    }
    return changed_squared;
  }

  void end(std::span<Float3> radiosity) const override {
    from_planes(planes_.data(), blocks_.plane_size(), radiosity);
  }

  int reads_per_sweep(SweepOrder /*order*/) const override { return 1; }

 private:
  void gather_from_outside(std::size_t group_begin, std::size_t group_end,
                           const Scheduler& scheduler) {
    parallel_for_pieces(scheduler, group_end - group_begin, kBlockRowsPerSweepTask,
                        [&](std::size_t k) {
                          outside_[k] = blocks_.gather_outside_group(group_begin + k, planes_);
                        });
  }

  double relax_group(std::size_t group_begin, std::size_t group_end, bool backward) {
    double changed_squared = 0;
    if (backward) {
      for (std::size_t i = group_end; i-- > group_begin;) changed_squared += relax_row(i);
    } else {
      for (std::size_t i = group_begin; i < group_end; ++i) changed_squared += relax_row(i);
    }
    return changed_squared;
  }

  double relax_row(std::size_t row) {
    const std::size_t stride = blocks_.plane_size();
    const Float3& outside = outside_[row % FormFactorBlocks::kGroup];
    const Float3 inside = blocks_.gather_inside_group(row, planes_);
    double changed_squared = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      float& radiosity = planes_[c * stride + row];
      const float next = problem_.initial_exitance[row][c] +
                         problem_.reflectance[row][c] * (outside[c] + inside[c]);
      const double change = static_cast<double>(next) - radiosity;
      changed_squared += problem_.area[row] * change * change;
      radiosity = next;
    }
    return changed_squared;
  }

  const FormFactorBlocks& blocks_;
  RelaxationProblem problem_;
  std::vector<float> planes_;    ///< B, in planes
  std::vector<Float3> outside_;  ///< [FormFactorBlocks::kGroup] gathered from outside the group
};

}  // namespace

std::unique_ptr<Relaxation> FormFactorBlocks::make_relaxation() const {
  return std::make_unique<BlockRowRelaxation>(*this);
}

}  // namespace rebounce

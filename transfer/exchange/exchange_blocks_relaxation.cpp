// Gauss-Seidel on half of a symmetric matrix. L is the half that is stored by rows. A forward sweep
// gathers L x of the new values. It needs L^T x of the old values; the backward sweep before it
// left that product. The backward sweep in turn uses the L x of the forward sweep (V. Conrad, Y.
// Wallach, "Alternating methods for sets of linear equations", 1979).

#include <algorithm>

#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/planes.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {
namespace {

constexpr std::size_t kGroup = ExchangeBlocks::kGroup, kSlotCount = ExchangeBlocks::kSlotCount;
constexpr std::size_t kExchangeRowsPerSweepTask = 16;

class ExchangeRelaxation final : public Relaxation {
 public:
  explicit ExchangeRelaxation(const ExchangeBlocks& exchange)
      : exchange_(exchange),
        stride_(exchange.plane_size()),
        radiosity_(kChannelCount * stride_),
        lower_(kChannelCount * stride_),
        upper_(kSlotCount * kChannelCount * stride_) {}

  void begin(const RelaxationProblem& problem, std::span<const Float3> radiosity) override {
    problem_ = problem;
    to_planes(radiosity, stride_, radiosity_.data());
    known_ = Known::kNothing;
  }

  double sweep(SweepDirection direction, const Scheduler& scheduler) override {
    return direction == SweepDirection::kForward ? sweep_forward(scheduler)
                                                 : sweep_backward(scheduler);
  }

  void end(std::span<Float3> radiosity) const override {
    from_planes(radiosity_.data(), stride_, radiosity);
  }

  int reads_per_sweep(SweepOrder order) const override {
    return order == SweepOrder::kSymmetric ? 1 : 2;
  }

 private:
  /// Which product with the current radiosity is available.
  enum class Known : std::uint8_t { kNothing, kLower, kUpper };

  double sweep_forward(const Scheduler& scheduler) {
    if (known_ != Known::kUpper) spread_all(scheduler);
    double changed_squared = 0;
    const std::size_t n = exchange_.patch_count();
    for (std::size_t begin = 0; begin < n; begin += kGroup) {
      const std::size_t end = std::min(begin + kGroup, n);
      gather_outside(begin, end, scheduler);
      for (std::size_t i = begin; i < end; ++i) {
        gather_inside(i);
        changed_squared += relax(i);
      }
    }
    known_ = Known::kLower;
    return changed_squared;
  }

  double sweep_backward(const Scheduler& scheduler) {
    if (known_ != Known::kLower) gather_all(scheduler);
    std::ranges::fill(upper_, 0.0F);
    double changed_squared = 0;
    const std::size_t n = exchange_.patch_count(), groups = (n + kGroup - 1) / kGroup;
    for (std::size_t k = groups; k-- > 0;) {
      const std::size_t begin = k * kGroup, end = std::min(begin + kGroup, n);
      for (std::size_t i = end; i-- > begin;) {
        changed_squared += relax(i);
        spread_inside(i);
      }
      spread_outside(begin, end, scheduler);
    }
    known_ = Known::kUpper;
    return changed_squared;
  }

  void gather_all(const Scheduler& scheduler) {
    parallel_for_pieces(scheduler, exchange_.patch_count(), kExchangeRowsPerSweepTask,
                        [this](std::size_t i) {
                          gather_outside_row(i);
                          gather_inside(i);
                        });
  }

  void spread_all(const Scheduler& scheduler) {
    std::ranges::fill(upper_, 0.0F);
    const std::size_t n = exchange_.patch_count();
    for (std::size_t begin = 0; begin < n; begin += kGroup) {
      const std::size_t end = std::min(begin + kGroup, n);
      for (std::size_t i = begin; i < end; ++i) spread_inside(i);
      spread_outside(begin, end, scheduler);
    }
  }

  void gather_outside(std::size_t begin, std::size_t end, const Scheduler& scheduler) {
    parallel_for_pieces(scheduler, end - begin, kExchangeRowsPerSweepTask,
                        [this, begin](std::size_t k) { gather_outside_row(begin + k); });
  }

  void gather_outside_row(std::size_t i) {
    const ExchangeBlocks::Row row = exchange_.row(i);
    Float3 sum;
    kernels().gather.gather(row.blocks, row.position, row.outside, radiosity_.data(), stride_,
                            sum.data());
    for (int c = 0; c < kChannelCount; ++c) lower_[c * stride_ + i] = sum[c];
  }

  void gather_inside(std::size_t i) {
    const ExchangeBlocks::Row row = exchange_.row(i);
    Float3 sum;
    kernels().gather.gather(row.blocks + row.outside, row.position + row.outside, row.inside,
                            radiosity_.data(), stride_, sum.data());
    for (int c = 0; c < kChannelCount; ++c) lower_[c * stride_ + i] += sum[c];
  }

  /// Spreads the group's rows to columns before the group, with one partial sum per slot.
  void spread_outside(std::size_t begin, std::size_t end, const Scheduler& scheduler) {
    parallel_for(scheduler, kSlotCount, [&](std::size_t s) {
      for (std::size_t i = begin + s; i < end; i += kSlotCount) {
        const ExchangeBlocks::Row row = exchange_.row(i);
        spread(row.blocks, row.position, row.outside, i, s);
      }
    });
  }

  void spread_inside(std::size_t i) {
    const ExchangeBlocks::Row row = exchange_.row(i);
    spread(row.blocks + row.outside, row.position + row.outside, row.inside, i, 0);
  }

  void spread(const FormFactorBlock* blocks, const std::uint32_t* position, std::size_t count,
              std::size_t row, std::size_t slot) {
    kernels().gather.spread(blocks, position, count, radiosity_at(row).data(),
                            upper_.data() + slot * kChannelCount * stride_, stride_);
  }

  double relax(std::size_t i) {
    double changed_squared = 0;
    const float area = exchange_.area(i);
    for (int c = 0; c < kChannelCount; ++c) {
      const std::size_t at = c * stride_ + i;
      float& radiosity = radiosity_[at];
      float arrived = lower_[at] + exchange_.diagonal(i) * radiosity;
      for (std::size_t s = 0; s < kSlotCount; ++s)
        arrived += upper_[s * kChannelCount * stride_ + at];
      const float next =
          problem_.initial_exitance[i][c] + problem_.reflectance[i][c] * (arrived / area);
      const double change = static_cast<double>(next) - radiosity;
      changed_squared += area * change * change;
      radiosity = next;
    }
    return changed_squared;
  }

  Float3 radiosity_at(std::size_t i) const {
    return {radiosity_[i], radiosity_[stride_ + i], radiosity_[2 * stride_ + i]};
  }

  const ExchangeBlocks& exchange_;
  std::size_t stride_;
  RelaxationProblem problem_;
  std::vector<float> radiosity_;  ///< B, in planes
  std::vector<float> lower_;      ///< L B, in planes
  std::vector<float> upper_;      ///< L^T B as one partial sum per slot, each in planes
  Known known_ = Known::kNothing;
};

}  // namespace

std::unique_ptr<Relaxation> ExchangeBlocks::make_relaxation() const {
  return std::make_unique<ExchangeRelaxation>(*this);
}

}  // namespace rebounce

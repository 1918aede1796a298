// Gauss-Seidel on a symmetric hierarchical matrix of which the lower half is stored. With L that
// half off the diagonal, D its diagonal blocks and x = A^1/2 B, a forward sweep is
//   x' = A^1/2 M0 + rho (L x' + D x + L^T x), a backward sweep the same with L and L^T exchanged.
// L x' of a forward sweep is what the backward sweep after it needs as its "values before", and the
// other way round: V. Conrad, Y. Wallach, "Alternating methods for sets of linear equations", 1979.

#include "cluster_relaxation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <vector>

#include "block_kernels.h"
#include "cluster_sweep_plan.h"
#include "hierarchical_storage.h"
#include "kernels_of_storage.h"

namespace rebounce {
namespace {

constexpr std::size_t kAlignment = HierarchicalOperator::kAlignment;

/// Three vectors, one to each channel, with room for whole vectors at the end.
class Planes {
 public:
  explicit Planes(std::size_t size)
      : stride_((size + kAlignment - 1) / kAlignment * kAlignment),
        values_(kChannelCount * stride_) {}

  float& at(int channel, std::size_t index) { return values_[channel * stride_ + index]; }
  float at(int channel, std::size_t index) const { return values_[channel * stride_ + index]; }
  void clear() { std::ranges::fill(values_, 0.0F); }

  PlanarVectors<float> to(std::size_t begin) {
    return {values_.data() + begin, stride_, kChannelCount};
  }
  PlanarVectors<const float> from(std::size_t begin) const {
    return {values_.data() + begin, stride_, kChannelCount};
  }

 private:
  std::size_t stride_;
  std::vector<float> values_;
};

/// Coefficients of three channels.
class CoefficientArray {
 public:
  explicit CoefficientArray(std::size_t size) : values_(size * kChannelLanes) {}

  float& at(int channel, std::size_t index) { return values_[index * kChannelLanes + channel]; }
  float at(int channel, std::size_t index) const {
    return values_[index * kChannelLanes + channel];
  }

  Coefficients<float> to(std::size_t begin) {
    return {values_.data() + begin * kChannelLanes, values_.size()};
  }
  Coefficients<const float> from(std::size_t begin) const {
    return {values_.data() + begin * kChannelLanes, values_.size()};
  }

 private:
  std::vector<float> values_;
};

template <typename Basis, typename Value>
class ClusterRelaxation final : public Relaxation {
 public:
  ClusterRelaxation(const HierarchicalOperator::Storage& exchange, const BasisKernels<Basis>& bases,
                    CoreKernel<Value> multiply_cores, const Basis* basis_values,
                    const Value* core_values, float basis_scale)
      : exchange_(exchange),
        bases_(bases),
        multiply_cores_(multiply_cores),
        basis_values_(basis_values),
        core_values_(core_values),
        value_scale_(product_scale(exchange.precision)),
        dense_scale_(basis_scale * basis_scale),
        plan_(exchange),
        light_(positions()),
        reflectance_(positions()),
        radiosity_(positions()),
        lower_(positions()),
        upper_(positions()),
        received_(positions()),
        sent_(plan_.coefficient_count),
        arrived_(plan_.coefficient_count) {}

  void begin(const RelaxationProblem& problem, std::span<const Float3> radiosity) override {
    area_ = problem.area;
    for (std::size_t k = 0; k < exchange_.patch.size(); ++k) {
      const std::uint32_t p = exchange_.patch[k];
      const float root = std::sqrt(area_[p]);
      for (int c = 0; c < kChannelCount; ++c) {
        light_.at(c, k) = root * problem.initial_exitance[p][c];
        reflectance_.at(c, k) = value_scale_ * problem.reflectance[p][c];
        radiosity_.at(c, k) = root * radiosity[p][c];
      }
    }
    known_ = Known::kNothing;
  }

  double sweep(SweepDirection direction) override {
    return direction == SweepDirection::kForward ? sweep_forward() : sweep_backward();
  }

  void end(std::span<Float3> radiosity) const override {
    for (std::size_t k = 0; k < exchange_.patch.size(); ++k) {
      const std::uint32_t p = exchange_.patch[k];
      const float root = std::sqrt(area_[p]);
      for (int c = 0; c < kChannelCount; ++c) radiosity[p][c] = radiosity_.at(c, k) / root;
    }
  }

  int reads_per_sweep(SweepOrder order) const override {
    return order == SweepOrder::kSymmetric ? 1 : 2;
  }

 private:
  using Plan = ClusterSweepPlan;

  /// Which product with the present radiosity there is.
  enum class Known : std::uint8_t { kNothing, kLower, kUpper };

  std::size_t positions() const {
    return HierarchicalOperator::position_count(exchange_.area.size());
  }

  double sweep_forward() {
    if (known_ != Known::kUpper) {
      pass_backward([](const Plan::Step&) { return 0.0; });
    }
    known_ = Known::kLower;
    return pass_forward(
        [this](const Plan::Step& step) { return relax(step, SweepDirection::kForward); });
  }

  double sweep_backward() {
    if (known_ != Known::kLower) {
      pass_forward([](const Plan::Step&) { return 0.0; });
    }
    known_ = Known::kUpper;
    return pass_backward(
        [this](const Plan::Step& step) { return relax(step, SweepDirection::kBackward); });
  }

  /// lower = L x, diagonal block after diagonal block; `visit` may change what a step holds of x
  /// once all that it receives is there. Returns the sum of what it returns.
  template <typename Visit>
  double pass_forward(const Visit& visit) {
    lower_.clear();
    double sum = 0;
    Plan::Step before;
    for (const Plan::Step& step : plan_.steps) {
      for (auto k = before.last_row_product; k < step.last_row_product; ++k) {
        send_to_rows(plan_.row_products[k]);
      }
      for (auto k = before.last_row_bases; k < step.last_row_bases; ++k) {
        expand(plan_.row_bases[k], lower_);
      }
      sum += visit(step);
      for (auto k = before.last_column_bases; k < step.last_column_bases; ++k) {
        project(plan_.column_bases[k]);
      }
      before = step;
    }
    return sum;
  }

  /// upper = L^T x, from the last diagonal block to the first.
  template <typename Visit>
  double pass_backward(const Visit& visit) {
    upper_.clear();
    double sum = 0;
    for (std::size_t s = plan_.steps.size(); s-- > 0;) {
      const Plan::Step& step = plan_.steps[s];
      const Plan::Step before = s > 0 ? plan_.steps[s - 1] : Plan::Step();
      for (auto k = before.last_column_product; k < step.last_column_product; ++k) {
        send_to_columns(plan_.column_products[k]);
      }
      for (auto k = before.last_column_bases; k < step.last_column_bases; ++k) {
        expand(plan_.column_bases[k], upper_);
      }
      sum += visit(step);
      for (auto k = before.last_row_bases; k < step.last_row_bases; ++k) {
        project(plan_.row_bases[k]);
      }
    }
    return sum;
  }

  void project(const BasisPart& basis) {
    bases_.project(basis_values_, {&basis, 1}, radiosity_.from(0), sent_.to(0));
  }

  void expand(const BasisPart& basis, Planes& arrived) {
    bases_.expand(basis_values_, {&basis, 1}, arrived_.from(0), arrived.to(0));
  }

  void send_to_rows(const Plan::Product& product) {
    const CoreBlock& core = product.core;
    if (product.dense) send(product.column_begin, core.columns, core.column);
    multiply(core, CoreBlock::Direction::kToRows);
    if (product.dense) add_arrived(core.row, core.rows, lower_, product.row_begin);
  }

  void send_to_columns(const Plan::Product& product) {
    const CoreBlock& core = product.core;
    if (product.dense) send(product.row_begin, core.rows, core.row);
    multiply(core, CoreBlock::Direction::kToColumns);
    if (product.dense) add_arrived(core.column, core.columns, upper_, product.column_begin);
  }

  void multiply(CoreBlock core, CoreBlock::Direction direction) {
    core.direction = direction;
    multiply_cores_(core_values_, {&core, 1}, lanes_, 1, sent_.from(0), arrived_.to(0));
  }

  /// Of a dense block, radiosity as it is for coefficients.
  void send(std::size_t begin, std::size_t count, std::size_t coefficient) {
    for (int c = 0; c < kChannelCount; ++c) {
      for (std::size_t k = 0; k < count; ++k) {
        sent_.at(c, coefficient + k) = radiosity_.at(c, begin + k);
      }
    }
  }

  void add_arrived(std::size_t coefficient, std::size_t count, Planes& to, std::size_t begin) {
    for (int c = 0; c < kChannelCount; ++c) {
      for (std::size_t k = 0; k < count; ++k) {
        to.at(c, begin + k) += dense_scale_ * arrived_.at(c, coefficient + k);
      }
    }
  }

  /// Relaxes the positions of a block on the diagonal.
  double relax(const Plan::Step& step, SweepDirection direction) {
    const TransferBlock& block = step.diagonal;
    const std::size_t begin = block.row_begin, end = begin + block.row_count;
    for (int c = 0; c < kChannelCount; ++c) {
      const float *lower = &lower_.at(c, 0), *upper = &upper_.at(c, 0);
      float* received = &received_.at(c, 0);
      for (std::size_t k = begin; k < end; ++k) received[k] = lower[k] + upper[k];
    }
    if (block.kind == TransferBlock::Kind::kDense) return relax_rows(step, direction);
    if (block.row_rank > 0) {
      project(step.basis);
      multiply(diagonal_core(step, block.row_rank, block.row_rank), CoreBlock::Direction::kToRows);
      expand(step.basis, received_);
    }
    return relax_at_once(begin, end);
  }

  static CoreBlock diagonal_core(const Plan::Step& step, std::uint32_t rows,
                                 std::uint32_t columns) {
    return {.values = step.values,
            .rows = rows,
            .columns = columns,
            .row = step.coefficient,
            .column = step.coefficient,
            .direction = CoreBlock::Direction::kToRows};
  }

  /// Relaxes positions that see nothing of each other but what has been received.
  double relax_at_once(std::size_t begin, std::size_t end) {
    double changed_squared = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      std::array<float, kAlignment> squares{};  // sums of their own, so that they are vectors
      for (std::size_t k = begin; k < end; k += kAlignment) {
        const float *light = &light_.at(c, k), *reflectance = &reflectance_.at(c, k);
        const float* received = &received_.at(c, k);
        float* x = &radiosity_.at(c, k);
        for (std::size_t j = 0; j < kAlignment; ++j) {
          const float next = light[j] + reflectance[j] * received[j];
          const float change = next - x[j];
          squares[j] += change * change;
          x[j] = next;
        }
      }
      for (const float square : squares) changed_squared += square;
    }
    return changed_squared;
  }

  double relax_rows(const Plan::Step& step, SweepDirection direction) {
    const std::uint32_t begin = step.diagonal.row_begin, size = step.diagonal.row_count;
    send(begin, size, step.coefficient);
    CoreBlock row_block = diagonal_core(step, 1, size);
    double changed_squared = 0;
    for (std::uint32_t k = 0; k < size; ++k) {
      const std::uint32_t row = direction == SweepDirection::kForward ? k : size - 1 - k;
      row_block.values = step.values + std::uint64_t{row} * size;
      multiply(row_block, CoreBlock::Direction::kToRows);
      changed_squared += relax_position(begin + row, step.coefficient);
      for (int c = 0; c < kChannelCount; ++c) {
        sent_.at(c, step.coefficient + row) = radiosity_.at(c, begin + row);
      }
    }
    return changed_squared;
  }

  /// `inside`: the coefficient that has come from within its block.
  double relax_position(std::size_t position, std::size_t inside) {
    double changed_squared = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      float& x = radiosity_.at(c, position);
      const float received = received_.at(c, position) + dense_scale_ * arrived_.at(c, inside);
      const float next = light_.at(c, position) + reflectance_.at(c, position) * received;
      const double change = static_cast<double>(next) - x;
      changed_squared += change * change;
      x = next;
    }
    return changed_squared;
  }

  const HierarchicalOperator::Storage& exchange_;
  const BasisKernels<Basis>& bases_;
  CoreKernel<Value> multiply_cores_;
  ChannelLanes lanes_{{0, 0, 0}, 1};  ///< one matrix for all channels
  const Basis* basis_values_;
  const Value* core_values_;
  float value_scale_;  ///< what a product with stored values is to be multiplied by
  float dense_scale_;  ///< of one with dense entries, which other light meets in both bases
  ClusterSweepPlan plan_;
  Planes light_, reflectance_, radiosity_;  ///< A^1/2 M0, rho x value_scale, A^1/2 B
  Planes lower_, upper_, received_;         ///< L x, L^T x, and both and D x
  CoefficientArray sent_, arrived_;         ///< coefficients of x, of cores
  std::span<const float> area_;
  Known known_ = Known::kNothing;
};

}  // namespace

std::unique_ptr<Relaxation> make_cluster_relaxation(const HierarchicalOperator::Storage& exchange) {
  const auto make = [&](const auto& bases, const auto& cores, const auto* basis_values,
                        const auto* core_values, float basis_scale) -> std::unique_ptr<Relaxation> {
    return std::make_unique<ClusterRelaxation<std::remove_cvref_t<decltype(*basis_values)>,
                                              std::remove_cvref_t<decltype(*core_values)>>>(
        exchange, bases, cores, basis_values, core_values, basis_scale);
  };
  return with_kernels_of(exchange, HierarchicalLayout(exchange), make);
}

}  // namespace rebounce

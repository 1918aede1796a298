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

template <typename Basis, typename Value>
class ClusterRelaxation final : public Relaxation {
 public:
  ClusterRelaxation(const HierarchicalOperator::Storage& exchange, const BasisKernels<Basis>& bases,
                    const CoreKernels<Value>& cores, const Basis* basis_values,
                    const Value* core_values)
      : exchange_(exchange),
        bases_(bases),
        cores_(cores),
        basis_values_(basis_values),
        core_values_(core_values),
        value_scale_(product_scale(exchange.precision)),
        plan_(exchange),
        light_(positions()),
        reflectance_(positions()),
        radiosity_(positions()),
        lower_(positions()),
        upper_(positions()),
        received_(positions()),
        sent_(plan_.coefficient_count),
        arrived_(plan_.coefficient_count),
        product_(plan_.largest_side) {}

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

  void project(const Plan::Bases& bases) {
    bases_.project(basis_values_ + bases.values, bases.rank, bases.size,
                   radiosity_.from(bases.begin), sent_.to(bases.coefficient));
  }

  void expand(const Plan::Bases& bases, Planes& arrived) {
    bases_.expand(basis_values_ + bases.values, bases.rank, bases.size, bases.size,
                  arrived_.from(bases.coefficient), arrived.to(bases.begin));
  }

  void send_to_rows(const Plan::Product& product) {
    if (!product.dense) {
      to_rows(product.values, product.rows, product.columns, sent_.from(product.column),
              arrived_.to(product.row));
      return;
    }
    to_rows(product.values, product.rows, product.columns, radiosity_.from(product.column),
            product_.to(0));
    add_product(product.rows, lower_, product.row);
  }

  void send_to_columns(const Plan::Product& product) {
    if (!product.dense) {
      to_columns(product, sent_.from(product.row), arrived_.to(product.column));
      return;
    }
    to_columns(product, radiosity_.from(product.row), product_.to(0));
    add_product(product.columns, upper_, product.column);
  }

  /// out = S in
  void to_rows(std::uint64_t values, std::size_t rows, std::size_t columns,
               const PlanarVectors<const float>& in, const PlanarVectors<float>& out) const {
    cores_.to_rows({core_values_ + values, rows, columns, {0, 0, 0}}, {in, in, out, out});
  }

  /// out = S^T in
  void to_columns(const Plan::Product& product, const PlanarVectors<const float>& in,
                  const PlanarVectors<float>& out) const {
    cores_.to_columns({core_values_ + product.values, product.rows, product.columns, {0, 0, 0}},
                      {in, in, out, out});
  }

  void add_product(std::size_t count, Planes& to, std::size_t begin) const {
    for (int c = 0; c < kChannelCount; ++c) {
      for (std::size_t k = 0; k < count; ++k) to.at(c, begin + k) += product_.at(c, k);
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
      const Plan::Bases bases{step.basis, block.row_rank, block.row_count, block.row_begin,
                              step.coefficient};
      project(bases);
      to_rows(step.values, block.row_rank, block.row_rank, sent_.from(step.coefficient),
              arrived_.to(step.coefficient));
      expand(bases, received_);
    }
    return relax_at_once(begin, end);
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
    const std::size_t begin = step.diagonal.row_begin, size = step.diagonal.row_count;
    double changed_squared = 0;
    for (std::size_t k = 0; k < size; ++k) {
      const std::size_t row = direction == SweepDirection::kForward ? k : size - 1 - k;
      Float3 inside;
      to_rows(step.values + row * size, 1, size, radiosity_.from(begin),
              {inside.data(), 1, kChannelCount});
      changed_squared += relax_position(begin + row, inside);
    }
    return changed_squared;
  }

  double relax_position(std::size_t position, const Float3& inside) {
    double changed_squared = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      float& x = radiosity_.at(c, position);
      const float next = light_.at(c, position) +
                         reflectance_.at(c, position) * (received_.at(c, position) + inside[c]);
      const double change = static_cast<double>(next) - x;
      changed_squared += change * change;
      x = next;
    }
    return changed_squared;
  }

  const HierarchicalOperator::Storage& exchange_;
  const BasisKernels<Basis>& bases_;
  const CoreKernels<Value>& cores_;
  const Basis* basis_values_;
  const Value* core_values_;
  float value_scale_;  ///< what a product with stored values is to be multiplied by
  ClusterSweepPlan plan_;
  Planes light_, reflectance_, radiosity_;  ///< A^1/2 M0, rho x value_scale, A^1/2 B
  Planes lower_, upper_, received_;         ///< L x, L^T x, and both and D x
  Planes sent_, arrived_, product_;         ///< coefficients of x, of cores; of one dense block
  std::span<const float> area_;
  Known known_ = Known::kNothing;
};

}  // namespace

std::unique_ptr<Relaxation> make_cluster_relaxation(const HierarchicalOperator::Storage& exchange) {
  const BlockKernelSet& kernels = block_kernels();
  const std::uint64_t first_core =
      HierarchicalLayout(exchange.blocks, exchange.matrix_count).basis_value_count;
  const auto make = [&](const auto& bases, const auto& cores, const auto* basis_values,
                        const auto* core_values) -> std::unique_ptr<Relaxation> {
    return std::make_unique<ClusterRelaxation<std::remove_cvref_t<decltype(*basis_values)>,
                                              std::remove_cvref_t<decltype(*core_values)>>>(
        exchange, bases, cores, basis_values, core_values);
  };
  const std::uint16_t* const f16 = exchange.values_f16.data();
  const float* const f32 = exchange.values_f32.data();
  switch (exchange.precision) {
    case Precision::kF16:
      return make(kernels.bases_f16, kernels.cores_f16, f16, f16 + first_core);
    case Precision::kF32:
      return make(kernels.bases_f32, kernels.cores_f32, f32, f32 + first_core);
    case Precision::kQ8:
      return make(kernels.bases_q8, kernels.cores_f16, exchange.bases_q8.data(), f16);
  }
  return nullptr;
}

}  // namespace rebounce

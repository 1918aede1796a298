// Gauss-Seidel on a symmetric hierarchical matrix with a stored lower half. L is this half without
// the diagonal blocks, D the diagonal blocks, and x = A^1/2 B. A forward sweep computes
//   x' = A^1/2 M0 + rho (L x' + D x + L^T x);
// a backward sweep exchanges L and L^T. A forward sweep leaves L x', and this is the product with
// the old values that a following backward sweep needs, and vice versa (V. Conrad, Y. Wallach,
// "Alternating methods for sets of linear equations", 1979). A forward sweep after another one
// computes L^T x as it goes: it multiplies a column of blocks with the old values of its rows just
// before it relaxes the column's positions, and with the new values just after. The second product
// reads the column from cache.
//
// For equilibrated patches, G = R K R: the unknown is R x, K replaces G, and rho R^2 replaces rho.

#include "transfer/exchange/cluster_relaxation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "transfer/exchange/cluster_sweep_plan.h"
#include "transfer/format/hierarchical_layout.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/kernels_of_storage.h"

namespace rebounce {
namespace {

constexpr std::size_t kAlignment = HierarchicalFormat::kAlignment;

/// Three vectors, one per channel, padded to whole registers.
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

/// Coefficients with three channels each.
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

class ClusterRelaxation final : public Relaxation {
 public:
  explicit ClusterRelaxation(const HierarchicalStorage& exchange)
      : exchange_(exchange),
        bases_(exchange),
        couplings_(exchange, HierarchicalLayout(exchange).basis_value_count),
        value_scale_(product_scale(bases_, couplings_)),
        dense_scale_(bases_.scale() * bases_.scale()),
        plan_(exchange),
        light_(positions()),
        reflectance_(positions()),
        radiosity_(positions()),
        change_weight_(positions(), 1.0F),
        lower_(positions()),
        upper_(positions()),
        received_(positions()),
        sent_(plan_.coefficient_count),
        arrived_(plan_.coefficient_count),
        scratch_(plan_.largest_scratch) {}

  void begin(const RelaxationProblem& problem, std::span<const Float3> radiosity) override {
    area_ = problem.area;
    radiosity_.clear();  // where there is no patch, sweeps of light that overflows leave NaN
    for (std::size_t k = 0; k < exchange_.patch.size(); ++k) {
      const std::uint32_t p = exchange_.patch[k];
      const float scale = exchange_.position_scale(k), root = scaled_root(k);
      for (int c = 0; c < kChannelCount; ++c) {
        light_.at(c, k) = root * problem.initial_exitance[p][c];
        reflectance_.at(c, k) = scale * scale * value_scale_ * problem.reflectance[p][c];
        radiosity_.at(c, k) = root * radiosity[p][c];
      }
      change_weight_[k] = 1 / (scale * scale);
    }
    known_ = Known::kNothing;
    rows_are_sent_ = false;
  }

  double sweep(SweepDirection direction, const Scheduler& /*scheduler*/) override {
    return direction == SweepDirection::kForward ? sweep_forward() : sweep_backward();
  }

  void end(std::span<Float3> radiosity) const override {
    for (std::size_t k = 0; k < exchange_.patch.size(); ++k) {
      const float root = scaled_root(k);
      Float3& of_patch = radiosity[exchange_.patch[k]];
      for (int c = 0; c < kChannelCount; ++c) of_patch[c] = radiosity_.at(c, k) / root;
    }
  }

  int reads_per_sweep(SweepOrder order) const override {
    return order == SweepOrder::kSymmetric ? 1 : 2;
  }

 private:
  using Plan = ClusterSweepPlan;

  /// Which product with the current radiosity is available.
  enum class Known : std::uint8_t { kNothing, kLower, kUpper };

  std::size_t positions() const {
    return HierarchicalFormat::position_count(exchange_.area.size());
  }

  /// The factor between radiosity and x at a position: R A^1/2.
  float scaled_root(std::size_t position) const {
    return exchange_.position_scale(position) * std::sqrt(area_[exchange_.patch[position]]);
  }

  double sweep_forward() {
    const bool alternating = known_ == Known::kUpper;
    if (!alternating && !rows_are_sent_) send_rows();
    known_ = Known::kLower;
    rows_are_sent_ = !alternating;
    return alternating ? pass_forward([this](std::size_t step) {
      return relax(plan_.steps[step], SweepDirection::kForward);
    })
                       : pass_both_ways();
  }

  double sweep_backward() {
    if (known_ != Known::kLower) pass_forward([](std::size_t) { return 0.0; });
    known_ = Known::kUpper;
    rows_are_sent_ = true;
    return pass_backward();
  }

  /// lower = L x, diagonal block after diagonal block. `visit`(step) may change x in the step's
  /// block; it is called when lower is complete there. Returns the sum of the returned values.
  template <typename Visit>
  double pass_forward(const Visit& visit) {
    lower_.clear();
    double sum = 0;
    for (std::size_t s = 0; s < plan_.steps.size(); ++s) {
      send_to_rows(plan_.to_beginning_rows, s);
      expand(plan_.row_bases.beginning.at(s), lower_);
      sum += visit(s);
      project(plan_.column_bases.ending.at(s));
    }
    return sum;
  }

  /// upper = L^T x' of the relaxed x', from the last diagonal block to the first.
  double pass_backward() {
    upper_.clear();
    double sum = 0;
    for (std::size_t s = plan_.steps.size(); s-- > 0;) {
      send_to_columns(plan_.to_ending_columns, s);
      expand(plan_.column_bases.ending.at(s), upper_);
      sum += relax(plan_.steps[s], SweepDirection::kBackward);
      project(plan_.row_bases.beginning.at(s));
    }
    return sum;
  }

  /// upper = L^T x and lower = L x' of the relaxed x'. The coefficients of x at row ends must be in
  /// sent_.
  double pass_both_ways() {
    lower_.clear();
    upper_.clear();
    double sum = 0;
    for (std::size_t s = 0; s < plan_.steps.size(); ++s) {
      send_to_columns(plan_.to_beginning_columns, s);
      expand(plan_.column_bases.beginning.at(s), upper_);
      expand(plan_.row_bases.beginning.at(s), lower_);
      sum += relax(plan_.steps[s], SweepDirection::kForward);
      project(plan_.column_bases.ending.at(s));
      send_to_rows(plan_.from_ending_columns, s);
      project(plan_.row_bases.ending.at(s));
    }
    return sum;
  }

  void send_rows() {
    for (std::size_t s = 0; s < plan_.steps.size(); ++s) project(plan_.row_bases.ending.at(s));
  }

  void project(std::span<const BasisPart> bases) {
    bases_.project(bases, radiosity_.from(0), nullptr, sent_.to(0));
  }

  void expand(std::span<const BasisPart> bases, Planes& arrived) {
    bases_.expand(bases, arrived_.from(0), arrived.to(0));
  }

  void send_to_rows(const Plan::Products& products, std::size_t step) {
    multiply(products.couplings.at(step));
    add_dense(products.dense.at(step), lower_);
  }

  void send_to_columns(const Plan::Products& products, std::size_t step) {
    multiply(products.couplings.at(step));
    add_dense(products.dense.at(step), upper_);
  }

  void multiply(std::span<const CouplingBlock> couplings) {
    couplings_.multiply(couplings, lanes_, 1, sent_.from(0), arrived_.to(0), scratch_.data());
  }

  void add_dense(std::span<const DenseBlock> blocks, Planes& to) {
    couplings_.add_dense(blocks, radiosity_.from(0), dense_scale_, to.to(0));
  }

  /// Relaxes the positions of a diagonal block.
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
      CouplingBlock coupling = diagonal_coupling(step, block.row_rank, block.row_rank);
      coupling.row_residual_rank = coupling.column_residual_rank = step.residual_rank;
      project({&step.basis, 1});
      multiply({&coupling, 1});
      expand({&step.basis, 1}, received_);
    }
    return relax_at_once(begin, end);
  }

  static CouplingBlock diagonal_coupling(const Plan::Step& step, std::uint32_t rows,
                                         std::uint32_t columns) {
    return {.values = step.values,
            .rows = rows,
            .columns = columns,
            .row = step.coefficient,
            .column = step.coefficient,
            .direction = CouplingBlock::Direction::kToRows,
            .first_row = step.first_row};
  }

  /// Relaxes positions independently of each other.
  double relax_at_once(std::size_t begin, std::size_t end) {
    double changed_squared = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      std::array<float, kAlignment> squares{};  // separate sums, which vectorise
      for (std::size_t k = begin; k < end; k += kAlignment) {
        const float *light = &light_.at(c, k), *reflectance = &reflectance_.at(c, k);
        const float *received = &received_.at(c, k), *weight = &change_weight_[k];
        float* x = &radiosity_.at(c, k);
        for (std::size_t j = 0; j < kAlignment; ++j) {
          const float next = light[j] + reflectance[j] * received[j];
          const float change = next - x[j];
          squares[j] += weight[j] * change * change;
          x[j] = next;
        }
      }
      for (const float square : squares) changed_squared += square;
    }
    return changed_squared;
  }

  double relax_rows(const Plan::Step& step, SweepDirection direction) {
    const std::uint32_t begin = step.diagonal.row_begin, size = step.diagonal.row_count;
    for (std::uint32_t k = 0; k < size; ++k) send(begin + k, step.coefficient + k);
    CouplingBlock row_block = diagonal_coupling(step, 1, size);
    double changed_squared = 0;
    for (std::uint32_t k = 0; k < size; ++k) {
      const std::uint32_t row = direction == SweepDirection::kForward ? k : size - 1 - k;
      row_block.values = step.values + std::uint64_t{row} * size;
      multiply({&row_block, 1});
      changed_squared += relax_position(begin + row, step.coefficient);
      send(begin + row, step.coefficient + row);
    }
    return changed_squared;
  }

  /// Within a dense block the coefficients are the radiosities themselves.
  void send(std::size_t position, std::size_t coefficient) {
    for (int c = 0; c < kChannelCount; ++c) {
      sent_.at(c, coefficient) = radiosity_.at(c, position);
    }
  }

  /// `inside`: the coefficient with the product of the position's own diagonal block.
  double relax_position(std::size_t position, std::size_t inside) {
    double changed_squared = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      float& x = radiosity_.at(c, position);
      const float received = received_.at(c, position) + dense_scale_ * arrived_.at(c, inside);
      const float next = light_.at(c, position) + reflectance_.at(c, position) * received;
      const double change = static_cast<double>(next) - x;
      changed_squared += change_weight_[position] * change * change;
      x = next;
    }
    return changed_squared;
  }

  const HierarchicalStorage& exchange_;
  BasisProducts bases_;
  CouplingProducts couplings_;
  ChannelLanes lanes_{{0, 0, 0}, 1};  ///< one matrix for all channels
  float value_scale_;  ///< turns products of stored values into products of real ones
  float dense_scale_;  ///< the same for dense entries, relative to value_scale_: they meet no basis
  ClusterSweepPlan plan_;
  /// R A^1/2 M0, R^2 rho times value_scale_, and R A^1/2 B.
  Planes light_, reflectance_, radiosity_;
  std::vector<float> change_weight_;  ///< [positions] R^-2, to measure changes of A^1/2 B
  Planes lower_, upper_, received_;   ///< L x, L^T x, and L x + L^T x + D x
  /// Coefficients of x, and their products with coupling matrices.
  CoefficientArray sent_, arrived_;
  std::vector<float> scratch_;  ///< input copies of one coupling matrix
  std::span<const float> area_;
  Known known_ = Known::kNothing;
  bool rows_are_sent_ = false;  ///< whether the coefficients of row ends are those of the current x
};

}  // namespace

std::unique_ptr<Relaxation> make_cluster_relaxation(const HierarchicalStorage& exchange) {
  return std::make_unique<ClusterRelaxation>(exchange);
}

}  // namespace rebounce

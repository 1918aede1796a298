// Gauss-Seidel on a symmetric hierarchical matrix of which the lower half is stored. With L that
// half off the diagonal, D its diagonal blocks and x = A^1/2 B, a forward sweep is
//   x' = A^1/2 M0 + rho (L x' + D x + L^T x), a backward sweep the same with L and L^T exchanged.
// L x' of a forward sweep is what the backward sweep after it needs as its "values before", and the
// other way round: V. Conrad, Y. Wallach, "Alternating methods for sets of linear equations", 1979.

#include "cluster_relaxation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <vector>

#include "block_kernels.h"

namespace rebounce {
namespace {

constexpr std::size_t kAlignment = HierarchicalOperator::kAlignment;

std::size_t round_up(std::size_t size) {
  return (size + kAlignment - 1) / kAlignment * kAlignment;
}

/// For each kAlignment positions, where the diagonal block that they are in begins.
std::vector<std::uint32_t> diagonal_begins(const HierarchicalOperator::Storage& exchange) {
  std::vector<std::uint32_t> begins(HierarchicalOperator::position_count(exchange.area.size()) /
                                    kAlignment);
  for (std::size_t k = 0; k < begins.size(); ++k) {
    begins[k] = static_cast<std::uint32_t>(k * kAlignment);
  }
  for (const TransferBlock& block : exchange.blocks) {
    if (!block.on_diagonal()) continue;
    std::fill_n(begins.begin() + block.row_begin / kAlignment, block.row_count / kAlignment,
                block.row_begin);
  }
  return begins;
}

/// The blocks in the order in which a forward sweep takes them: before one on the diagonal come
/// those to the left of it, whose columns are swept by then and whose rows are not.
std::vector<TransferBlock> sweep_order(const HierarchicalOperator::Storage& exchange) {
  const std::vector<std::uint32_t> begins = diagonal_begins(exchange);
  std::vector<TransferBlock> blocks = exchange.blocks;
  std::ranges::stable_sort(blocks, {}, [&](const TransferBlock& block) {
    return std::tuple(begins[block.row_begin / kAlignment], block.on_diagonal());
  });
  return blocks;
}

/// Vectors over the positions of the clusters, channel after channel.
struct Planes {
  std::size_t stride;
  std::vector<float> values;

  explicit Planes(std::size_t positions) : stride(positions), values(kChannelCount * positions) {}

  float* at(std::size_t position) { return values.data() + position; }
  const float* at(std::size_t position) const { return values.data() + position; }
  void clear() { std::ranges::fill(values, 0.0F); }
};

template <typename Value>
class ClusterRelaxation final : public Relaxation {
 public:
  ClusterRelaxation(const HierarchicalOperator::Storage& exchange,
                    const BlockKernels<Value>& kernels, const Value* values, float value_scale)
      : exchange_(exchange),
        kernels_(kernels),
        values_(values),
        value_scale_(value_scale),
        blocks_(sweep_order(exchange)),
        stride_(HierarchicalOperator::position_count(exchange.area.size())),
        light_(stride_),
        reflectance_(stride_),
        radiosity_(stride_),
        lower_(stride_),
        upper_(stride_),
        received_(stride_) {
    std::uint32_t largest = 0;
    for (const TransferBlock& block : blocks_) {
      largest = std::max({largest, block.row_rank, block.column_rank});
      if (block.kind == TransferBlock::Kind::kDense) largest = std::max(largest, block.row_count);
    }
    rank_stride_ = round_up(largest);
    for (auto* buffer : {&row_in_, &column_in_, &row_out_, &column_out_}) {
      buffer->resize(kChannelCount * rank_stride_);
    }
  }

  void begin(const RelaxationProblem& problem, std::span<const Float3> radiosity) override {
    for (std::size_t k = 0; k < exchange_.patch.size(); ++k) {
      const std::uint32_t p = exchange_.patch[k];
      const float root = std::sqrt(problem.area[p]);
      for (int c = 0; c < kChannelCount; ++c) {
        light_.at(k)[c * stride_] = root * problem.initial_exitance[p][c];
        reflectance_.at(k)[c * stride_] = value_scale_ * problem.reflectance[p][c];
        radiosity_.at(k)[c * stride_] = root * radiosity[p][c];
      }
    }
    area_ = problem.area;
    known_ = Known::kNothing;
  }

  double sweep(SweepDirection direction) override {
    return direction == SweepDirection::kForward ? sweep_forward() : sweep_backward();
  }

  void end(std::span<Float3> radiosity) const override {
    for (std::size_t k = 0; k < exchange_.patch.size(); ++k) {
      const std::uint32_t p = exchange_.patch[k];
      const float root = std::sqrt(area_[p]);
      for (int c = 0; c < kChannelCount; ++c) {
        radiosity[p][c] = radiosity_.at(k)[c * stride_] / root;
      }
    }
  }

  int reads_per_sweep(SweepOrder order) const override {
    return order == SweepOrder::kSymmetric ? 1 : 2;
  }

 private:
  /// Which product with the present radiosity there is.
  enum class Known : std::uint8_t { kNothing, kLower, kUpper };

  double sweep_forward() {
    if (known_ != Known::kUpper) {
      upper_.clear();
      for (const TransferBlock& block : blocks_) add_upper(block);
    }
    lower_.clear();
    double changed_squared = 0;
    for (const TransferBlock& block : blocks_) {
      add_lower(block);
      if (block.on_diagonal()) changed_squared += relax(block, SweepDirection::kForward);
    }
    known_ = Known::kLower;
    return changed_squared;
  }

  double sweep_backward() {
    if (known_ != Known::kLower) {
      lower_.clear();
      for (const TransferBlock& block : blocks_) add_lower(block);
    }
    upper_.clear();
    double changed_squared = 0;
    for (auto block = blocks_.rbegin(); block != blocks_.rend(); ++block) {
      if (block->on_diagonal()) changed_squared += relax(*block, SweepDirection::kBackward);
      add_upper(*block);
    }
    known_ = Known::kUpper;
    return changed_squared;
  }

  /// lower += B x for a block off the diagonal.
  void add_lower(const TransferBlock& block) {
    if (block.on_diagonal()) return;
    const float* x = radiosity_.at(block.column_begin);
    float* y = lower_.at(block.row_begin);
    if (block.kind == TransferBlock::Kind::kDense) {
      kernels_.project(values_ + block.offset, block.row_count, block.column_count, x, stride_,
                       row_out_.data(), rank_stride_);
      add_rows(block.row_count, y);
    } else if (has_rank(block)) {
      project_columns(block, x);
      multiply_core(block);
      kernels_.expand(row_basis(block), block.row_rank, block.row_count, row_out_.data(),
                      rank_stride_, y, stride_);
    }
  }

  /// upper += B^T x for a block off the diagonal.
  void add_upper(const TransferBlock& block) {
    if (block.on_diagonal()) return;
    const float* x = radiosity_.at(block.row_begin);
    float* y = upper_.at(block.column_begin);
    if (block.kind == TransferBlock::Kind::kDense) {
      for (int c = 0; c < kChannelCount; ++c) {
        std::copy_n(x + c * stride_, block.row_count, row_in_.data() + c * rank_stride_);
      }
      kernels_.expand(values_ + block.offset, block.row_count, block.column_count, row_in_.data(),
                      rank_stride_, y, stride_);
    } else if (has_rank(block)) {
      kernels_.project(row_basis(block), block.row_rank, block.row_count, x, stride_,
                       row_in_.data(), rank_stride_);
      multiply_core(block);
      kernels_.expand(column_basis(block), block.column_rank, block.column_count,
                      column_out_.data(), rank_stride_, y, stride_);
    }
  }

  /// Relaxes the rows of a block on the diagonal.
  double relax(const TransferBlock& block, SweepDirection direction) {
    const std::size_t begin = block.row_begin, size = block.row_count;
    for (int c = 0; c < kChannelCount; ++c) {
      const std::size_t first = c * stride_ + begin;
      for (std::size_t k = 0; k < size; ++k) {
        received_.at(first)[k] = lower_.at(first)[k] + upper_.at(first)[k];
      }
    }
    if (block.kind == TransferBlock::Kind::kDense) return relax_rows(block, direction);
    if (has_rank(block)) {
      project_columns(block, radiosity_.at(begin));
      multiply_core(block);
      kernels_.expand(row_basis(block), block.row_rank, size, row_out_.data(), rank_stride_,
                      received_.at(begin), stride_);
    }
    double changed_squared = 0;
    for (std::size_t k = begin; k < begin + size; ++k) changed_squared += relax_position(k, {});
    return changed_squared;
  }

  double relax_rows(const TransferBlock& block, SweepDirection direction) {
    const std::size_t size = block.row_count;
    double changed_squared = 0;
    for (std::size_t k = 0; k < size; ++k) {
      const std::size_t row = direction == SweepDirection::kForward ? k : size - 1 - k;
      Float3 inside;
      kernels_.project(values_ + block.offset + row * size, 1, size,
                       radiosity_.at(block.column_begin), stride_, inside.data(), 1);
      changed_squared += relax_position(block.row_begin + row, inside);
    }
    return changed_squared;
  }

  double relax_position(std::size_t position, const Float3& inside) {
    double changed_squared = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      const std::size_t at = c * stride_ + position;
      float& x = *radiosity_.at(at);
      const float next = *light_.at(at) + *reflectance_.at(at) * (*received_.at(at) + inside[c]);
      const double change = static_cast<double>(next) - x;
      changed_squared += change * change;
      x = next;
    }
    return changed_squared;
  }

  static bool has_rank(const TransferBlock& block) {
    return block.row_rank > 0 && block.column_rank > 0;
  }

  const Value* row_basis(const TransferBlock& block) const { return values_ + block.offset; }

  const Value* column_basis(const TransferBlock& block) const {
    if (block.on_diagonal()) return row_basis(block);
    return row_basis(block) + std::size_t{block.row_rank} * block.row_count;
  }

  /// column_in = V^T x
  void project_columns(const TransferBlock& block, const float* x) {
    kernels_.project(column_basis(block), block.column_rank, block.column_count, x, stride_,
                     column_in_.data(), rank_stride_);
  }

  /// row_out = S column_in and column_out = S^T row_in, of which one is wanted.
  void multiply_core(const TransferBlock& block) {
    const std::size_t rows = block.row_rank, columns = block.column_rank;
    const Value* core = column_basis(block) + columns * block.column_count;
    for (int c = 0; c < kChannelCount; ++c) {
      const std::size_t at = c * rank_stride_;
      std::fill(column_in_.data() + at + columns, column_in_.data() + at + round_up(columns), 0.0F);
      kernels_.core(core, rows, columns, column_in_.data() + at, row_in_.data() + at,
                    row_out_.data() + at, column_out_.data() + at);
    }
  }

  void add_rows(std::size_t rows, float* y) const {
    for (int c = 0; c < kChannelCount; ++c) {
      for (std::size_t k = 0; k < rows; ++k) y[c * stride_ + k] += row_out_[c * rank_stride_ + k];
    }
  }

  const HierarchicalOperator::Storage& exchange_;
  const BlockKernels<Value>& kernels_;
  const Value* values_;
  float value_scale_;  ///< what a product with stored values is to be multiplied by
  std::vector<TransferBlock> blocks_;
  std::size_t stride_, rank_stride_ = 0;
  Planes light_, reflectance_, radiosity_;  ///< A^1/2 M0, rho x value_scale, A^1/2 B
  Planes lower_, upper_, received_;         ///< L x, L^T x, and both and D x
  std::vector<float> row_in_, column_in_, row_out_, column_out_;  ///< of one block
  std::span<const float> area_;
  Known known_ = Known::kNothing;
};

}  // namespace

std::unique_ptr<Relaxation> make_cluster_relaxation(const HierarchicalOperator::Storage& exchange) {
  if (exchange.precision == Precision::kF16) {
    return std::make_unique<ClusterRelaxation<std::uint16_t>>(exchange, block_kernels().f16,
                                                              exchange.values_f16.data(),
                                                              1 / HierarchicalOperator::kHalfScale);
  }
  return std::make_unique<ClusterRelaxation<float>>(exchange, block_kernels().f32,
                                                    exchange.values_f32.data(), 1.0F);
}

}  // namespace rebounce

#include "transfer/exchange/cluster_sweep_plan.h"

#include <algorithm>
#include <utility>

namespace rebounce {
namespace {

constexpr auto kStepRows = static_cast<std::uint32_t>(HierarchicalFormat::kAlignment);

using Step = ClusterSweepPlan::Step;
using Direction = CouplingBlock::Direction;

template <typename T>
using StepVectors = std::vector<std::vector<T>>;

/// Coupling matrices of one step are independent. Sorting them by shape makes branches predictable.
std::pair<std::uint32_t, std::uint32_t> shape(const CouplingBlock& coupling) {
  return {coupling.columns, coupling.rows};
}

/// Collects the bases of all steps.
struct BasesOfSteps {
  explicit BasesOfSteps(std::size_t step_count) : beginning(step_count), ending(step_count) {}
  ClusterSweepPlan::Bases made() const {
    return {ClusterSweepPlan::ByStep(beginning), ClusterSweepPlan::ByStep(ending)};
  }
  StepVectors<BasisPart> beginning, ending;
};

struct ProductsOfSteps {
  ProductsOfSteps(std::size_t step_count, Direction to)
      : direction(to), couplings(step_count), dense(step_count) {}
  ClusterSweepPlan::Products made() {
    for (std::vector<CouplingBlock>& step : couplings) std::ranges::stable_sort(step, {}, shape);
    return {ClusterSweepPlan::ByStep(couplings), ClusterSweepPlan::ByStep(dense)};
  }
  Direction direction;
  StepVectors<CouplingBlock> couplings;
  StepVectors<DenseBlock> dense;
};

class Planner {
 public:
  Planner(const HierarchicalStorage& storage, ClusterSweepPlan& plan)
      : blocks_(storage.blocks),
        layout_(storage),
        plan_(plan),
        step_at_(HierarchicalFormat::position_count(storage.area.size()) / kStepRows, 0) {}

  void run() {
    add_steps();
    add_bases();
    add_products();
    plan_.coefficient_count = layout_.coefficient_count;
    plan_.largest_scratch = layout_.largest_scratch;
  }

 private:
  void add_steps() {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (!blocks_[b].on_diagonal()) continue;
      const HierarchicalLayout::BlockLayout& block_layout = layout_.block_layouts[b];
      plan_.steps.push_back({.diagonal = blocks_[b],
                             .basis = basis_of(blocks_[b], block_layout.row, blocks_[b].row_rank),
                             .values = block_layout.values,
                             .first_row = block_layout.first_row,
                             .coefficient = block_layout.row.coefficient,
                             .residual_rank = block_layout.row.residual_rank});
    }
    add_missing_steps();
    std::ranges::sort(plan_.steps, {}, [](const Step& step) { return step.diagonal.row_begin; });
    for (std::size_t s = 0; s < plan_.steps.size(); ++s) {
      const TransferBlock& block = plan_.steps[s].diagonal;
      std::fill_n(step_at_.begin() + block.row_begin / kStepRows, block.row_count / kStepRows,
                  static_cast<std::uint32_t>(s));
    }
  }

  /// Positions without a diagonal block get steps too: they must be relaxed.
  void add_missing_steps() {
    std::vector<bool> held(step_at_.size(), false);
    for (const Step& step : plan_.steps) {
      std::fill_n(held.begin() + step.diagonal.row_begin / kStepRows,
                  step.diagonal.row_count / kStepRows, true);
    }
    for (std::uint32_t k = 0; k < held.size(); ++k) {
      if (held[k]) continue;
      plan_.steps.push_back({.diagonal = {.row_begin = k * kStepRows,
                                          .row_count = kStepRows,
                                          .column_begin = k * kStepRows,
                                          .column_count = kStepRows,
                                          .kind = TransferBlock::Kind::kLowRank}});
    }
  }

  /// The basis at one end of a block, a range of ranks of its cluster.
  BasisPart basis_of(const TransferBlock& block, const HierarchicalLayout::End& end,
                     std::uint32_t rank) const {
    if (block.kind == TransferBlock::Kind::kDense || !has_values(block)) return {};
    const HierarchicalLayout::Cluster& cluster = layout_.clusters[end.cluster];
    const std::uint32_t first = end.coefficient - cluster.coefficient;
    return {.values = cluster.values,
            .rank = cluster.rank,
            .size = cluster.size,
            .coefficient = cluster.coefficient,
            .position = cluster.begin,
            .first_rank = first,
            .last_rank = first + rank + end.residual_rank,
            .first_offset = 0,
            .last_offset = cluster.size};
  }

  void add_bases() {
    BasesOfSteps rows(plan_.steps.size()), columns(plan_.steps.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const TransferBlock& block = blocks_[b];
      if (!is_below_diagonal(block) || block.kind == TransferBlock::Kind::kDense) continue;
      const HierarchicalLayout::BlockLayout& block_layout = layout_.block_layouts[b];
      add_basis(rows, rows_of(block), basis_of(block, block_layout.row, block.row_rank));
      add_basis(columns, columns_of(block),
                basis_of(block, block_layout.column, block.column_rank));
    }
    plan_.row_bases = rows.made();
    plan_.column_bases = columns.made();
  }

  void add_products() {
    const std::size_t count = plan_.steps.size();
    ProductsOfSteps to_beginning_rows(count, Direction::kToRows),
        to_beginning_columns(count, Direction::kToColumns),
        to_ending_columns(count, Direction::kToColumns),
        from_ending_columns(count, Direction::kToRows);
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (!is_below_diagonal(blocks_[b])) continue;
      const Steps rows = rows_of(blocks_[b]), columns = columns_of(blocks_[b]);
      add_product(to_beginning_rows, rows.first, b);
      add_product(to_beginning_columns, columns.first, b);
      add_product(to_ending_columns, columns.last, b);
      add_product(from_ending_columns, columns.last, b);
    }
    plan_.to_beginning_rows = to_beginning_rows.made();
    plan_.to_beginning_columns = to_beginning_columns.made();
    plan_.to_ending_columns = to_ending_columns.made();
    plan_.from_ending_columns = from_ending_columns.made();
  }

  static bool is_below_diagonal(const TransferBlock& block) {
    return has_values(block) && !block.on_diagonal();
  }

  /// The steps that contain the first and the last position of a range.
  struct Steps {
    std::uint32_t first, last;
  };

  Steps steps_of(std::uint32_t begin, std::uint32_t count) const {
    return {step_at_[begin / kStepRows], step_at_[(begin + count) / kStepRows - 1]};
  }

  Steps rows_of(const TransferBlock& block) const {
    return steps_of(block.row_begin, block.row_count);
  }
  Steps columns_of(const TransferBlock& block) const {
    return steps_of(block.column_begin, block.column_count);
  }

  void add_product(ProductsOfSteps& products, std::uint32_t step, std::size_t b) const {
    const TransferBlock& block = blocks_[b];
    const HierarchicalLayout::BlockLayout& block_layout = layout_.block_layouts[b];
    if (block.kind == TransferBlock::Kind::kDense) {
      products.dense[step].push_back({.values = block_layout.values,
                                      .rows = block.row_count,
                                      .columns = block.column_count,
                                      .row_position = block.row_begin,
                                      .column_position = block.column_begin,
                                      .row_out = 0,
                                      .column_out = 0,
                                      .direction = products.direction});
    } else {
      products.couplings[step].push_back({.values = block_layout.values,
                                          .rows = block.row_rank,
                                          .columns = block.column_rank,
                                          .row = block_layout.row.coefficient,
                                          .column = block_layout.column.coefficient,
                                          .direction = products.direction,
                                          .row_residual_rank = block_layout.row.residual_rank,
                                          .column_residual_rank = block_layout.column.residual_rank,
                                          .first_row = block_layout.first_row});
    }
  }

  static void add_basis(BasesOfSteps& bases, const Steps& steps, const BasisPart& basis) {
    add_basis(bases.beginning[steps.first], basis);
    add_basis(bases.ending[steps.last], basis);
  }

  /// Joins `basis` to the one whose ranks end where its own begin.
  static void add_basis(std::vector<BasisPart>& all, const BasisPart& basis) {
    for (BasisPart& before : all) {
      if (before.coefficient == basis.coefficient && before.last_rank == basis.first_rank) {
        before.last_rank = basis.last_rank;
        return;
      }
    }
    all.push_back(basis);
  }

  const std::vector<TransferBlock>& blocks_;
  HierarchicalLayout layout_;
  ClusterSweepPlan& plan_;
  std::vector<std::uint32_t> step_at_;  ///< [positions / kStepRows]
};

}  // namespace

ClusterSweepPlan::ClusterSweepPlan(const HierarchicalStorage& storage) {
  Planner(storage, *this).run();
}

}  // namespace rebounce

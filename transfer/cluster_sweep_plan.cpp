#include "cluster_sweep_plan.h"

#include <algorithm>

namespace rebounce {
namespace {

constexpr auto kAlignment = static_cast<std::uint32_t>(HierarchicalOperator::kAlignment);

using Bases = ClusterSweepPlan::Bases;
using Product = ClusterSweepPlan::Product;
using Step = ClusterSweepPlan::Step;

/// Blocks by the step that they belong to.
template <typename T>
using ByStep = std::vector<std::vector<T>>;

/// One after the other; `last` is where each step's end.
template <typename T>
std::vector<T> concatenate(const ByStep<T>& by_step, std::vector<Step>& steps,
                           std::uint32_t Step::*last) {
  std::vector<T> all;
  for (std::size_t s = 0; s < steps.size(); ++s) {
    all.insert(all.end(), by_step[s].begin(), by_step[s].end());
    steps[s].*last = static_cast<std::uint32_t>(all.size());
  }
  return all;
}

class Planner {
 public:
  Planner(const HierarchicalOperator::Storage& storage, ClusterSweepPlan& plan)
      : blocks_(storage.blocks),
        layout_(storage),
        plan_(plan),
        step_at_(HierarchicalOperator::position_count(storage.area.size()) / kAlignment, 0) {}

  void run() {
    add_steps();
    row_bases_.resize(plan_.steps.size());
    column_bases_ = row_bases_;
    row_products_.resize(plan_.steps.size());
    column_products_ = row_products_;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (has_values(blocks_[b]) && !blocks_[b].on_diagonal()) add_block(b);
    }
    plan_.row_bases = concatenate(row_bases_, plan_.steps, &Step::last_row_bases);
    plan_.column_bases = concatenate(column_bases_, plan_.steps, &Step::last_column_bases);
    plan_.row_products = concatenate(row_products_, plan_.steps, &Step::last_row_product);
    plan_.column_products = concatenate(column_products_, plan_.steps, &Step::last_column_product);
    plan_.coefficient_count = layout_.coefficient_count;
  }

 private:
  void add_steps() {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (!blocks_[b].on_diagonal()) continue;
      const HierarchicalLayout::Place& place = layout_.places[b];
      plan_.steps.push_back({.diagonal = blocks_[b],
                             .basis = basis_of(blocks_[b], place.row),
                             .values = place.values,
                             .coefficient = place.row.coefficient});
    }
    add_missing_steps();
    std::ranges::sort(plan_.steps, {}, [](const Step& step) { return step.diagonal.row_begin; });
    for (std::size_t s = 0; s < plan_.steps.size(); ++s) {
      const TransferBlock& block = plan_.steps[s].diagonal;
      std::fill_n(step_at_.begin() + block.row_begin / kAlignment, block.row_count / kAlignment,
                  static_cast<std::uint32_t>(s));
    }
  }

  /// Positions that no diagonal block holds are relaxed too.
  void add_missing_steps() {
    std::vector<bool> held(step_at_.size(), false);
    for (const Step& step : plan_.steps) {
      std::fill_n(held.begin() + step.diagonal.row_begin / kAlignment,
                  step.diagonal.row_count / kAlignment, true);
    }
    for (std::uint32_t k = 0; k < held.size(); ++k) {
      if (held[k]) continue;
      plan_.steps.push_back({.diagonal = {.row_begin = k * kAlignment,
                                          .row_count = kAlignment,
                                          .column_begin = k * kAlignment,
                                          .column_count = kAlignment,
                                          .kind = TransferBlock::Kind::kLowRank}});
    }
  }

  /// Where the basis at an end of a block begins.
  std::uint64_t basis_of(const TransferBlock& block, const HierarchicalLayout::End& end) const {
    const bool has_basis = block.kind == TransferBlock::Kind::kLowRank && has_values(block);
    return has_basis ? layout_.basis_index(end, 0, 0) : 0;
  }

  void add_block(std::size_t b) {
    const TransferBlock& block = blocks_[b];
    const HierarchicalLayout::Place& place = layout_.places[b];
    const std::uint32_t row_step = step_at_[block.row_begin / kAlignment];
    const std::uint32_t column_step =
        step_at_[(block.column_begin + block.column_count) / kAlignment - 1];
    const bool dense = block.kind == TransferBlock::Kind::kDense;
    const Product product{.core = {.values = place.values,
                                   .rows = dense ? block.row_count : block.row_rank,
                                   .columns = dense ? block.column_count : block.column_rank,
                                   .row = place.row.coefficient,
                                   .column = place.column.coefficient,
                                   .direction = CoreBlock::Direction::kBoth},
                          .row_begin = block.row_begin,
                          .column_begin = block.column_begin,
                          .dense = dense};
    if (!dense) {
      add_bases(row_bases_[row_step], {basis_of(block, place.row), block.row_rank, block.row_count,
                                       block.row_begin, place.row.coefficient});
      add_bases(column_bases_[column_step],
                {basis_of(block, place.column), block.column_rank, block.column_count,
                 block.column_begin, place.column.coefficient});
    }
    row_products_[row_step].push_back(product);
    column_products_[column_step].push_back(product);
  }

  /// Joins bases that follow each other.
  static void add_bases(std::vector<Bases>& all, const Bases& bases) {
    for (Bases& before : all) {
      if (before.begin == bases.begin && before.size == bases.size &&
          before.coefficient + before.rank == bases.coefficient) {
        before.rank += bases.rank;
        return;
      }
    }
    all.push_back(bases);
  }

  const std::vector<TransferBlock>& blocks_;
  HierarchicalLayout layout_;
  ClusterSweepPlan& plan_;
  std::vector<std::uint32_t> step_at_;  ///< of each kAlignment positions
  ByStep<Bases> row_bases_, column_bases_;
  ByStep<Product> row_products_, column_products_;
};

}  // namespace

ClusterSweepPlan::ClusterSweepPlan(const HierarchicalOperator::Storage& storage) {
  Planner(storage, *this).run();
}

}  // namespace rebounce

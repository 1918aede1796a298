#include "cluster_sweep_plan.h"

#include <algorithm>

namespace rebounce {
namespace {

constexpr auto kAlignment = static_cast<std::uint32_t>(HierarchicalOperator::kAlignment);

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
                             .basis = basis_of(blocks_[b], place.row, blocks_[b].row_rank),
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

  /// The basis at an end of a block, which begins where the cluster's does or later.
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
            .last_rank = first + rank,
            .first_place = 0,
            .last_place = cluster.size};
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
      add_basis(row_bases_[row_step], basis_of(block, place.row, block.row_rank));
      add_basis(column_bases_[column_step], basis_of(block, place.column, block.column_rank));
    }
    row_products_[row_step].push_back(product);
    column_products_[column_step].push_back(product);
  }

  /// Joins bases that follow each other.
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
  std::vector<std::uint32_t> step_at_;  ///< of each kAlignment positions
  ByStep<BasisPart> row_bases_, column_bases_;
  ByStep<Product> row_products_, column_products_;
};

}  // namespace

ClusterSweepPlan::ClusterSweepPlan(const HierarchicalOperator::Storage& storage) {
  Planner(storage, *this).run();
}

}  // namespace rebounce

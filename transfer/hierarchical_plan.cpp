#include "hierarchical_plan.h"

#include <algorithm>

namespace rebounce {
namespace {

constexpr std::uint32_t kAlignment = HierarchicalOperator::kAlignment;

// Parts of a phase: enough for the threads of a desktop to share it evenly.
constexpr std::uint64_t kPartCount = 32;

/// Bounds of kPartCount runs of entries of about equal total weight.
template <typename Entry, typename Weight>
std::vector<std::uint32_t> share_out(const std::vector<Entry>& entries, const Weight& weight) {
  std::uint64_t total = 0, done = 0;
  for (const Entry& entry : entries) total += weight(entry);
  std::vector<std::uint32_t> bounds{0};
  for (std::uint32_t k = 0; k < entries.size(); ++k) {
    if (done * kPartCount >= total * bounds.size()) bounds.push_back(k);
    done += weight(entries[k]);
  }
  bounds.push_back(static_cast<std::uint32_t>(entries.size()));
  return bounds;
}

/// Which runs of kAlignment positions are wanted, and how many of them there are before each.
class WantedRuns {
 public:
  WantedRuns(std::span<const std::uint32_t> targets, std::size_t position_count)
      : wanted_(position_count / kAlignment), before_(wanted_.size() + 1) {
    for (const std::uint32_t target : targets) wanted_[target / kAlignment] = true;
    for (std::size_t k = 0; k < wanted_.size(); ++k) before_[k + 1] = before_[k] + wanted_[k];
  }
  bool any(std::uint32_t begin, std::uint32_t count) const {
    return before_[(begin + count) / kAlignment] > before_[begin / kAlignment];
  }
  /// visit(first, last) for the longest wanted intervals within [begin, end).
  template <typename Visit>
  void visit_intervals(std::uint32_t begin, std::uint32_t end, const Visit& visit) const {
    for (std::uint32_t at = begin; at < end;) {
      if (!wanted_[at / kAlignment]) {
        at += kAlignment;
        continue;
      }
      const std::uint32_t first = at;
      while (at < end && wanted_[at / kAlignment]) at += kAlignment;
      visit(first, at);
    }
  }
  std::size_t run_count() const { return wanted_.size(); }

 private:
  std::vector<bool> wanted_;
  std::vector<std::uint32_t> before_;
};

class Planner {
 public:
  using Layout = HierarchicalLayout;
  using Plan = HierarchicalPlan;

  Planner(const HierarchicalOperator::Storage& storage, const Layout& layout, Plan& plan)
      : storage_(storage),
        layout_(layout),
        plan_(plan),
        positions_(HierarchicalOperator::position_count(storage.area.size())),
        wanted_(plan.targets, positions_),
        in_(layout.coefficient_count),
        out_(layout.coefficient_count) {}

  void make() {
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      if (has_values(storage_.blocks[b])) add_core(storage_.blocks[b], layout_.places[b]);
    }
    for (const Layout::Cluster& cluster : layout_.clusters) add_projections(cluster);
    add_arrivals();
    count_bases();
    using Projection = Plan::Projection;
    plan_.projection_parts = share_out(
        plan_.projections, [](const Projection& p) { return std::uint64_t{p.rank} * p.size; });
    plan_.core_parts = share_out(plan_.cores, [](const Plan::Core& core) {
      return std::uint64_t{core.rows} * core.columns;
    });
  }

 private:
  void add_core(const TransferBlock& block, const Layout::Place& place) {
    const bool to_rows = wanted_.any(block.row_begin, block.row_count);
    const bool to_columns =
        !block.on_diagonal() && wanted_.any(block.column_begin, block.column_count);
    if (!to_rows && !to_columns) return;
    const bool dense = block.kind == TransferBlock::Kind::kDense;
    using Direction = Plan::Direction;
    Plan::Core core{.values = place.values,
                    .rows = dense ? block.row_count : block.row_rank,
                    .columns = dense ? block.column_count : block.column_rank,
                    .row_in = dense ? block.row_begin : place.row.coefficient,
                    .column_in = dense ? block.column_begin : place.column.coefficient,
                    .row_out = place.row.coefficient,
                    .column_out = place.column.coefficient,
                    .dense = dense,
                    .direction = !to_columns ? Direction::kToRows
                                 : !to_rows  ? Direction::kToColumns
                                             : Direction::kBoth};
    plan_.cores.push_back(core);
    plan_.value_count += std::uint64_t{storage_.matrix_count} * core.rows * core.columns;
    if (dense) {
      if (to_rows) dense_.push_back({0, 0, 0, block.row_begin, block.row_count, core.row_out});
      if (to_columns) {
        dense_.push_back({0, 0, 0, block.column_begin, block.column_count, core.column_out});
      }
      return;
    }
    if (to_rows) mark(in_, core.column_in, core.columns), mark(out_, core.row_out, core.rows);
    if (to_columns) mark(in_, core.row_in, core.rows), mark(out_, core.column_out, core.columns);
  }

  static void mark(std::vector<bool>& marks, std::uint32_t begin, std::uint32_t count) {
    std::fill_n(marks.begin() + begin, count, true);
  }

  /// visit(first, last) for the longest runs of marked coefficients of a cluster.
  template <typename Visit>
  static void visit_marked(const std::vector<bool>& marks, const Layout::Cluster& cluster,
                           const Visit& visit) {
    const std::uint32_t end = cluster.coefficient + cluster.rank;
    for (std::uint32_t c = cluster.coefficient; c < end;) {
      if (!marks[c]) {
        ++c;
        continue;
      }
      const std::uint32_t first = c;
      while (c < end && marks[c]) ++c;
      visit(first, c);
    }
  }

  static std::uint64_t basis_at(const Layout::Cluster& cluster, std::uint32_t coefficient) {
    return cluster.values + std::uint64_t{coefficient - cluster.coefficient} * cluster.size;
  }

  void add_projections(const Layout::Cluster& cluster) {
    visit_marked(in_, cluster, [&](std::uint32_t first, std::uint32_t last) {
      plan_.projections.push_back(
          {basis_at(cluster, first), last - first, cluster.size, cluster.begin, first});
    });
  }

  /// Work of bringing light to each run of positions.
  std::vector<std::uint64_t> arrival_weights() const {
    std::vector<std::uint64_t> weight(wanted_.run_count());
    for (const Layout::Cluster& cluster : layout_.clusters) {
      for (std::uint32_t k = 0; k < cluster.size; k += kAlignment) {
        weight[(cluster.begin + k) / kAlignment] += cluster.rank;
      }
    }
    for (std::size_t k = 0; k < weight.size(); ++k) {
      const auto begin = static_cast<std::uint32_t>(k * kAlignment);
      weight[k] = wanted_.any(begin, kAlignment) ? weight[k] + 1 : 0;
    }
    return weight;
  }

  void add_arrivals() {
    const std::vector<std::uint64_t> weight = arrival_weights();
    const std::vector<std::uint32_t> bounds =
        share_out(weight, [](std::uint64_t run_weight) { return run_weight; });
    std::uint32_t target = 0;
    for (std::size_t k = 0; k + 1 < bounds.size(); ++k) {
      Plan::Arrival arrival{};
      arrival.begin = bounds[k] * kAlignment;
      arrival.end = bounds[k + 1] * kAlignment;
      arrival.first_expansion = static_cast<std::uint32_t>(plan_.expansions.size());
      add_expansions(arrival.begin, arrival.end);
      arrival.last_expansion = static_cast<std::uint32_t>(plan_.expansions.size());
      arrival.first_target = target;
      while (target < plan_.targets.size() && plan_.targets[target] < arrival.end) ++target;
      arrival.last_target = target;
      if (arrival.first_target < arrival.last_target) plan_.arrivals.push_back(arrival);
    }
  }

  void add_expansions(std::uint32_t begin, std::uint32_t end) {
    for (const Layout::Cluster& cluster : layout_.clusters) {
      const std::uint32_t from = std::max(begin, cluster.begin);
      const std::uint32_t to = std::min(end, cluster.begin + cluster.size);
      if (from >= to) continue;
      visit_marked(out_, cluster, [&](std::uint32_t first, std::uint32_t last) {
        wanted_.visit_intervals(from, to, [&](std::uint32_t at, std::uint32_t stop) {
          plan_.expansions.push_back({basis_at(cluster, first) + at - cluster.begin, last - first,
                                      cluster.size, at, stop - at, first});
        });
      });
    }
    for (const Plan::Expansion& products : dense_) {
      const std::uint32_t from = std::max(begin, products.begin);
      const std::uint32_t to = std::min(end, products.begin + products.count);
      if (from >= to) continue;
      plan_.expansions.push_back(
          {0, 0, 0, from, to - from, products.coefficient + from - products.begin});
    }
  }

  void count_bases() {
    for (const Layout::Cluster& cluster : layout_.clusters) {
      for (std::uint32_t r = 0; r < cluster.rank; ++r) {
        const std::uint32_t c = cluster.coefficient + r;
        if (in_[c] || out_[c]) plan_.value_count += cluster.size;
      }
    }
  }

  const HierarchicalOperator::Storage& storage_;
  const Layout& layout_;
  Plan& plan_;
  std::size_t positions_;
  WantedRuns wanted_;
  std::vector<bool> in_, out_;          ///< which coefficients are needed, before and after cores
  std::vector<Plan::Expansion> dense_;  ///< products of dense blocks, whole
};

}  // namespace

HierarchicalPlan::HierarchicalPlan(const HierarchicalOperator::Storage& storage,
                                   const HierarchicalLayout& layout,
                                   std::vector<std::uint32_t> target_positions)
    : targets(std::move(target_positions)) {
  Planner(storage, layout, *this).make();
}

}  // namespace rebounce

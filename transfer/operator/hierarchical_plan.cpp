#include "transfer/operator/hierarchical_plan.h"

#include <algorithm>
#include <utility>

namespace rebounce {
namespace {

constexpr std::uint32_t kAlignment = HierarchicalFormat::kAlignment;

constexpr std::uint64_t kMostParts = HierarchicalPlan::kMostParts;

/// Cuts `entries` into kMostParts runs of about equal total weight and returns the bounds of the
/// runs.
template <typename Entry, typename Weight>
std::vector<std::uint32_t> share_out(const std::vector<Entry>& entries, const Weight& weight) {
  std::uint64_t total = 0, done = 0;
  for (const Entry& entry : entries) total += weight(entry);
  std::vector<std::uint32_t> bounds{0};
  for (std::uint32_t k = 0; k < entries.size(); ++k) {
    if (done * kMostParts >= total * bounds.size()) bounds.push_back(k);
    done += weight(entries[k]);
  }
  bounds.push_back(static_cast<std::uint32_t>(entries.size()));
  return bounds;
}

/// The positions of patches that are sources.
std::vector<std::uint32_t> source_positions(const HierarchicalStorage& storage) {
  std::vector<std::uint32_t> positions;
  for (std::uint32_t k = 0; k < storage.patch.size(); ++k) {
    if (storage.roles.is_source(storage.patch[k])) positions.push_back(k);
  }
  return positions;
}

/// Marks the runs of kAlignment positions that are wanted, and counts the marked runs before each.
class WantedRuns {
 public:
  WantedRuns(std::span<const std::uint32_t> positions, std::size_t position_count)
      : wanted_(position_count / kAlignment), before_(wanted_.size() + 1) {
    for (const std::uint32_t position : positions) wanted_[position / kAlignment] = true;
    for (std::size_t k = 0; k < wanted_.size(); ++k) before_[k + 1] = before_[k] + wanted_[k];
  }
  bool any(std::uint32_t begin, std::uint32_t count) const {
    return before_[(begin + count) / kAlignment] > before_[begin / kAlignment];
  }
  /// Calls visit(first, last) for the longest wanted intervals within [begin, end).
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

/// Marks `positions` and the cluster coefficients of the clusters that contain one of them.
WantedRuns with_cluster_coefficients(const HierarchicalStorage& storage,
                                     std::vector<std::uint32_t> positions,
                                     std::size_t position_count,
                                     std::size_t cluster_coefficient_count) {
  const WantedRuns wanted(positions, position_count);
  for (const TransferBlock& block : storage.blocks) {
    if (!is_cluster_basis(block) || !wanted.any(block.row_begin, block.row_count)) continue;
    const std::uint32_t end = block.column_begin + block.column_count;
    for (std::uint32_t run = block.column_begin / kAlignment; run * kAlignment < end; ++run) {
      positions.push_back(run * kAlignment);
    }
  }
  return {positions, position_count + cluster_coefficient_count};
}

class Planner {
 public:
  using Layout = HierarchicalLayout;
  using Plan = HierarchicalPlan;

  Planner(const HierarchicalStorage& storage, const Layout& layout, Plan& plan)
      : storage_(storage),
        layout_(layout),
        plan_(plan),
        positions_(HierarchicalFormat::position_count(storage.area.size())),
        wanted_(with_cluster_coefficients(storage, plan.targets, positions_,
                                          layout.cluster_coefficient_count)),
        lit_(with_cluster_coefficients(storage, source_positions(storage), positions_,
                                       layout.cluster_coefficient_count)),
        in_(layout.coefficient_count),
        out_(layout.coefficient_count),
        cluster_in_(layout.cluster_coefficient_count),
        cluster_out_(layout.cluster_coefficient_count) {}

  void make() {
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      const TransferBlock& block = storage_.blocks[b];
      if (!is_cluster_basis(block) && has_values(block))
        add_coupling(block, layout_.block_layouts[b]);
    }
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      if (is_cluster_basis(storage_.blocks[b]))
        add_cluster_basis(storage_.blocks[b], layout_.block_layouts[b].row);
    }
    mark_groups_in();
    for (const Layout::Cluster& cluster : layout_.clusters) add_projections(cluster);
    const auto first_cluster_run = static_cast<std::uint32_t>(positions_ / kAlignment);
    add_arrivals(0, first_cluster_run, plan_.arrivals);
    add_arrivals(first_cluster_run, static_cast<std::uint32_t>(wanted_.run_count()),
                 plan_.cluster_arrivals);
    count_bases();
    const auto values = [](const BasisPart& part) {
      return std::uint64_t{part.last_rank - part.first_rank} * part.size;
    };
    plan_.projection_parts = share_out(plan_.projections, values);
    plan_.cluster_projection_parts = share_out(plan_.cluster_projections, values);
    const auto entries = [](const auto& coupling) {
      return std::uint64_t{coupling.rows} * coupling.columns;
    };
    plan_.coupling_parts = share_out(plan_.couplings, entries);
    plan_.dense_parts = share_out(plan_.dense, entries);
  }

 private:
  void add_coupling(const TransferBlock& block, const Layout::BlockLayout& block_layout) {
    const bool to_rows =
        leads({block.column_begin, block.column_count}, {block.row_begin, block.row_count});
    const bool to_columns = !block.on_diagonal() && leads({block.row_begin, block.row_count},
                                                          {block.column_begin, block.column_count});
    if (!to_rows && !to_columns) return;
    const bool dense = block.kind == TransferBlock::Kind::kDense;
    using Direction = CouplingBlock::Direction;
    const CouplingBlock coupling{.values = block_layout.values,
                                 .rows = dense ? block.row_count : block.row_rank,
                                 .columns = dense ? block.column_count : block.column_rank,
                                 .row = block_layout.row.coefficient,
                                 .column = block_layout.column.coefficient,
                                 .direction = !to_columns ? Direction::kToRows
                                              : !to_rows  ? Direction::kToColumns
                                                          : Direction::kBoth,
                                 .row_residual_rank = block_layout.row.residual_rank,
                                 .column_residual_rank = block_layout.column.residual_rank,
                                 .first_row = block_layout.first_row};
    if (dense && storage_.matrix_count == 1) {
      plan_.dense.push_back({.values = coupling.values,
                             .rows = coupling.rows,
                             .columns = coupling.columns,
                             .row_position = block.row_begin,
                             .column_position = block.column_begin,
                             .row_out = coupling.row,
                             .column_out = coupling.column,
                             .direction = coupling.direction});
    } else {
      plan_.couplings.push_back(coupling);
    }
    plan_.value_count += std::uint64_t{storage_.matrix_count} * coupling.rows * coupling.columns;
    const DenseEnd rows =
        whole_end(block.row_begin, coupling.rows + coupling.row_residual_rank, coupling.row);
    const DenseEnd columns = whole_end(
        block.column_begin, coupling.columns + coupling.column_residual_rank, coupling.column);
    const Positions at_rows{block.row_begin, block.row_count};
    const Positions at_columns{block.column_begin, block.column_count};
    if (to_rows) {
      add_way(dense, columns, rows);
      mark_cluster_coefficients(at_columns, at_rows);
    }
    if (to_columns) {
      add_way(dense, rows, columns);
      mark_cluster_coefficients(at_rows, at_columns);
    }
  }

  void add_cluster_basis(const TransferBlock& block, const Layout::End& end) {
    const auto scale = static_cast<std::uint32_t>(block.column_begin - positions_);
    const Plan::ClusterBasis basis{end.coefficient, block.row_rank, end.residual_rank,
                                   block.column_begin, scale};
    const std::uint32_t count = block.row_rank + end.residual_rank;
    const auto any = [&](const std::vector<bool>& marks) {
      const auto first = marks.begin() + scale;
      return std::find(first, first + block.column_count, true) != first + block.column_count;
    };
    if (any(cluster_in_)) {
      mark(in_, end.coefficient, count);
      plan_.cluster_bases_in.push_back(basis);
    }
    if (any(cluster_out_) && wanted_.any(block.row_begin, block.row_count)) {
      mark(out_, end.coefficient, count);
      plan_.cluster_bases_out.push_back(basis);
    }
  }

  static DenseEnd whole_end(std::uint32_t position, std::uint32_t count,
                            std::uint32_t coefficient) {
    return {position, count, coefficient, 0, count};
  }

  struct Positions {
    std::uint32_t begin, count;
  };

  /// Marks the cluster coefficients that a block reads and those that it adds to.
  void mark_cluster_coefficients(const Positions& from, const Positions& to) {
    const auto mark_range = [this](std::vector<bool>& marks, const Positions& range) {
      if (range.begin < positions_) return;
      mark(marks, static_cast<std::uint32_t>(range.begin - positions_), range.count);
    };
    mark_range(cluster_in_, from);
    mark_range(cluster_out_, to);
  }

  /// Whether `from` contains a source and `to` a target.
  bool leads(const Positions& from, const Positions& to) const {
    return lit_.any(from.begin, from.count) && wanted_.any(to.begin, to.count);
  }

  /// Records the input and the output of a coupling matrix or dense block in one direction.
  void add_way(bool dense, const DenseEnd& from, const DenseEnd& to) {
    if (dense) {
      if (storage_.matrix_count > 1) plan_.dense_in.push_back(from);
      dense_out_.push_back(to);
    } else {
      mark(in_, from.coefficient, from.count);
      mark(out_, to.coefficient, to.count);
    }
  }

  static void mark(std::vector<bool>& marks, std::uint32_t begin, std::uint32_t count) {
    std::fill_n(marks.begin() + begin, count, true);
  }

  /// Ranks with interleaved values are projected together.
  void mark_groups_in() {
    const std::uint32_t group = layout_.rank_group;
    for (std::uint32_t c = 0; c < layout_.coefficient_count; c += group) {
      const auto first = in_.begin() + c;
      const auto last = in_.begin() + std::min(c + group, layout_.coefficient_count);
      if (std::find(first, last, true) != last) std::fill(first, last, true);
    }
  }

  /// Calls visit(first, last) for the longest runs of ranks of a cluster with marked coefficients.
  template <typename Visit>
  static void visit_marked(const std::vector<bool>& marks, const Layout::Cluster& cluster,
                           const Visit& visit) {
    for (std::uint32_t r = 0; r < cluster.rank;) {
      if (!marks[cluster.coefficient + r]) {
        ++r;
        continue;
      }
      const std::uint32_t first = r;
      while (r < cluster.rank && marks[cluster.coefficient + r]) ++r;
      visit(first, r);
    }
  }

  BasisPart part_of(const Layout::Cluster& cluster, std::uint32_t first_rank,
                    std::uint32_t last_rank, std::uint32_t first_offset,
                    std::uint32_t last_offset) const {
    return {.values = cluster.values,
            .rank = cluster.rank,
            .size = cluster.size,
            .coefficient = cluster.coefficient,
            .position = cluster.begin,
            .first_rank = first_rank,
            .last_rank = last_rank,
            .first_offset = first_offset,
            .last_offset = last_offset,
            .over_cluster_coefficients = cluster.begin >= positions_};
  }

  void add_projections(const Layout::Cluster& cluster) {
    std::vector<BasisPart>& parts =
        cluster.begin < positions_ ? plan_.projections : plan_.cluster_projections;
    visit_marked(in_, cluster, [&](std::uint32_t first, std::uint32_t last) {
      parts.push_back(part_of(cluster, first, last, 0, cluster.size));
    });
  }

  /// The work of expanding coefficients at each run of positions.
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

  /// For each run, the ranks of the clusters that a cut before this run divides.
  std::vector<std::uint64_t> cut_ranks() const {
    std::vector<std::uint64_t> ranks(wanted_.run_count());
    for (const Layout::Cluster& cluster : layout_.clusters) {
      for (std::uint32_t k = kAlignment; k < cluster.size; k += kAlignment) {
        ranks[(cluster.begin + k) / kAlignment] += cluster.rank;
      }
    }
    return ranks;
  }

  /// Cuts the runs [first, last) into shares of about equal work. Each bound moves to the nearby
  /// cut that divides the fewest ranks, because the coefficients of a cluster are prepared anew in
  /// each share.
  std::vector<std::uint32_t> arrival_bounds(std::uint32_t first_run, std::uint32_t last_run) const {
    std::vector<std::uint64_t> weight = arrival_weights(), cut = cut_ranks();
    const auto keep_runs = [&](std::vector<std::uint64_t>& runs) {
      runs.erase(runs.begin() + last_run, runs.end());
      runs.erase(runs.begin(), runs.begin() + first_run);
    };
    keep_runs(weight);
    keep_runs(cut);
    std::vector<std::uint32_t> bounds =
        share_out(weight, [](std::uint64_t run_weight) { return run_weight; });
    for (std::size_t k = 1; k + 1 < bounds.size(); ++k) {
      const std::uint32_t first = std::max(bounds[k - 1] + 1, bounds[k] - reach(bounds, k, k - 1));
      const std::uint32_t last = bounds[k] + reach(bounds, k + 1, k);
      const auto least = std::min_element(cut.begin() + first, cut.begin() + last + 1);
      bounds[k] = static_cast<std::uint32_t>(least - cut.begin());
    }
    for (std::uint32_t& bound : bounds) bound += first_run;
    return bounds;
  }

  /// How far a bound may move.
  static std::uint32_t reach(const std::vector<std::uint32_t>& bounds, std::size_t end,
                             std::size_t begin) {
    return (bounds[end] - bounds[begin]) / 2;
  }

  /// Adds the arrivals at the runs [first, last) of positions or of cluster coefficients.
  void add_arrivals(std::uint32_t first_run, std::uint32_t last_run,
                    std::vector<Plan::Arrival>& arrivals) {
    if (first_run == last_run) return;
    const std::vector<std::uint32_t> bounds = arrival_bounds(first_run, last_run);
    std::uint32_t target = 0;
    for (std::size_t k = 0; k + 1 < bounds.size(); ++k) {
      Plan::Arrival arrival{};
      arrival.begin = bounds[k] * kAlignment;
      arrival.end = bounds[k + 1] * kAlignment;
      arrival.first_expansion = static_cast<std::uint32_t>(plan_.expansions.size());
      add_expansions(arrival.begin, arrival.end);
      arrival.last_expansion = static_cast<std::uint32_t>(plan_.expansions.size());
      arrival.first_dense = static_cast<std::uint32_t>(plan_.dense_out.size());
      add_dense_ends(arrival.begin, arrival.end);
      arrival.last_dense = static_cast<std::uint32_t>(plan_.dense_out.size());
      arrival.first_target = target;
      while (target < plan_.targets.size() && plan_.targets[target] < arrival.end) ++target;
      arrival.last_target = target;
      if (wanted_.any(arrival.begin, arrival.end - arrival.begin)) arrivals.push_back(arrival);
    }
  }

  void add_expansions(std::uint32_t begin, std::uint32_t end) {
    for (const Layout::Cluster& cluster : layout_.clusters) {
      const std::uint32_t from = std::max(begin, cluster.begin);
      const std::uint32_t to = std::min(end, cluster.begin + cluster.size);
      if (from >= to) continue;
      visit_marked(out_, cluster, [&](std::uint32_t first, std::uint32_t last) {
        wanted_.visit_intervals(from, to, [&](std::uint32_t at, std::uint32_t stop) {
          plan_.expansions.push_back(
              part_of(cluster, first, last, at - cluster.begin, stop - cluster.begin));
        });
      });
    }
  }

  void add_dense_ends(std::uint32_t begin, std::uint32_t end) {
    for (const DenseEnd& whole : dense_out_) {
      const std::uint32_t from = std::max(begin, whole.position);
      const std::uint32_t to = std::min(end, whole.position + whole.count);
      if (from < to) {
        plan_.dense_out.push_back(
            {from, to - from, whole.coefficient, from - whole.position, whole.size});
      }
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

  const HierarchicalStorage& storage_;
  const Layout& layout_;
  Plan& plan_;
  std::size_t positions_;  ///< number of positions; cluster coefficients follow
  /// Runs with targets, runs with sources; cluster coefficients included.
  WantedRuns wanted_, lit_;
  /// [coefficients] whether the input, the output of coupling matrices is needed.
  std::vector<bool> in_, out_;
  std::vector<bool> cluster_in_, cluster_out_;
  std::vector<DenseEnd> dense_out_;  ///< not yet cut at the arrivals
};

}  // namespace

HierarchicalPlan::HierarchicalPlan(const HierarchicalStorage& storage,
                                   const HierarchicalLayout& layout,
                                   std::vector<std::uint32_t> target_positions,
                                   std::vector<std::uint32_t> dark_patches)
    : targets(std::move(target_positions)), dark(std::move(dark_patches)) {
  Planner(storage, layout, *this).make();
}

}  // namespace rebounce

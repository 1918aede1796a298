#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hierarchical_layout.h"

namespace rebounce {

/// What an apply of a hierarchical operator does, in three phases that each stream through its
/// values: the light of the clusters to its coefficients in the bases; cores and dense blocks;
/// coefficients back to the light that arrives. Within a phase all tasks write to places of their
/// own, whatever thread works on them: no sum depends on the number of threads.
class HierarchicalPlan {
 public:
  /// Some bases of a cluster, and the light that goes through them.
  struct Projection {
    std::uint64_t basis;
    std::uint32_t rank, size, begin, coefficient;
  };

  enum class Direction : std::uint8_t { kBoth, kToRows, kToColumns };

  /// A core or a dense block. What goes in are coefficients, or positions if `dense`; what comes
  /// out are always coefficients.
  struct Core {
    std::uint64_t values;
    std::uint32_t rows, columns;
    std::uint32_t row_in, column_in, row_out, column_out;
    bool dense;
    Direction direction;
  };

  /// Positions [begin, begin + count) of bases [rank][size], or if `rank` is 0 of what came out of
  /// a dense block.
  struct Expansion {
    std::uint64_t basis;
    std::uint32_t rank, size, begin, count, coefficient;
  };

  /// Positions that one thread works out from the first addition to the last.
  struct Arrival {
    std::uint32_t begin, end;  ///< positions, multiples of kAlignment
    std::uint32_t first_expansion, last_expansion;
    std::uint32_t first_target, last_target;

    std::uint32_t target_count() const { return last_target - first_target; }
  };

  /// Everything that it takes to write the positions `targets`, ascending.
  HierarchicalPlan(const HierarchicalOperator::Storage& storage, const HierarchicalLayout& layout,
                   std::vector<std::uint32_t> targets);

  std::vector<Projection> projections;
  std::vector<Core> cores;
  std::vector<Expansion> expansions;
  std::vector<std::uint32_t> targets;
  std::vector<Arrival> arrivals;
  /// [first, last) of the parts of about equal work that threads take in turn.
  std::vector<std::uint32_t> projection_parts, core_parts;
  std::uint64_t value_count = 0;  ///< that are read, each counted once
};

}  // namespace rebounce

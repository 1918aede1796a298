#pragma once

#include <cstdint>
#include <vector>

#include "block_kernels.h"
#include "hierarchical_layout.h"

namespace rebounce {

/// What a Gauss-Seidel sweep over a symmetric hierarchical matrix does, diagonal block after
/// diagonal block. Of the blocks below the diagonal, those to the left of it receive what earlier
/// positions send in a forward sweep, and send in a backward one; those below it the other way
/// round.
struct ClusterSweepPlan {
  /// A core or a dense block below the diagonal; its row and column are coefficients.
  struct Product {
    CoreBlock core;
    std::uint32_t row_begin, column_begin;  ///< positions
    bool dense;
  };

  /// A block on the diagonal, and ranges of what belongs to it.
  struct Step {
    TransferBlock diagonal;
    BasisPart basis{};         ///< U^T
    std::uint64_t values = 0;  ///< S or the entries
    std::uint32_t coefficient = 0;
    std::uint32_t last_row_bases = 0, last_column_bases = 0;  ///< one past, from the step before on
    std::uint32_t last_row_product = 0, last_column_product = 0;
  };

  explicit ClusterSweepPlan(const HierarchicalOperator::Storage& storage);

  std::vector<Step> steps;  ///< by position
  /// Bases of row ends of clusters that begin in a step's block, of column ends of clusters that
  /// end in it; those that follow each other are joined.
  std::vector<BasisPart> row_bases, column_bases;
  /// Blocks whose rows begin in a step's block, and blocks whose columns end in it.
  std::vector<Product> row_products, column_products;
  std::uint32_t coefficient_count = 0;
};

}  // namespace rebounce

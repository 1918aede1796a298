#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/kernels/block_kernels.h"

namespace rebounce {

/// What a Gauss-Seidel sweep over a symmetric hierarchical matrix does, diagonal block after
/// diagonal block. Of the blocks below the diagonal, those to the left of it receive what earlier
/// positions send in a forward sweep, and send in a backward one; those below it the other way
/// round.
struct ClusterSweepPlan {
  /// A block on the diagonal.
  struct Step {
    TransferBlock diagonal;
    BasisPart basis{};         ///< U^T
    std::uint64_t values = 0;  ///< S or the entries
    std::uint32_t coefficient = 0;
    std::uint32_t residual_rank = 0;
  };

  /// What is done at each step.
  template <typename T>
  class ByStep {
   public:
    ByStep() = default;
    explicit ByStep(const std::vector<std::vector<T>>& by_step) {
      for (const std::vector<T>& step : by_step) {
        all_.insert(all_.end(), step.begin(), step.end());
        last_.push_back(all_.size());
      }
    }
    std::span<const T> at(std::size_t step) const {
      const std::size_t first = step > 0 ? last_[step - 1] : 0;
      return std::span(all_).subspan(first, last_[step] - first);
    }

   private:
    std::vector<T> all_;
    std::vector<std::size_t> last_;
  };

  /// Bases of the row ends or of the column ends of blocks, at the steps in which their clusters
  /// begin, and at those in which they end; those that follow each other are joined.
  struct Bases {
    ByStep<BasisPart> beginning, ending;
  };

  /// Blocks below the diagonal in one direction. The products of dense ones are put in the place of
  /// the first coefficients.
  struct Products {
    ByStep<CouplingBlock> couplings;
    ByStep<DenseBlock> dense;
  };

  explicit ClusterSweepPlan(const HierarchicalStorage& storage);

  std::vector<Step> steps;  ///< by position
  Bases row_bases, column_bases;
  Products to_beginning_rows;     ///< at the step in which their rows begin
  Products to_beginning_columns;  ///< at the step in which their columns begin
  Products to_ending_columns;     ///< at the step in which their columns end
  Products from_ending_columns;   ///< to rows, likewise
  std::uint32_t coefficient_count = 0;
  std::size_t largest_taken = 0;  ///< as HierarchicalLayout has it
};

}  // namespace rebounce

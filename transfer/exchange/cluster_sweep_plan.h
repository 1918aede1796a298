#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/kernels/block_kernels.h"

namespace rebounce {

/// The steps of a Gauss-Seidel sweep over a symmetric hierarchical matrix, one for each diagonal
/// block. In a forward sweep, the blocks to the left of a diagonal block receive what earlier
/// positions send; in a backward sweep they send. The blocks below it do the reverse.
struct ClusterSweepPlan {
  /// A diagonal block.
  struct Step {
    TransferBlock diagonal;
    BasisPart basis{};                     ///< U^T
    std::uint64_t values = 0;              ///< index of S or of the entries
    std::uint32_t first_row = kNotPacked;  ///< as in CouplingBlock
    std::uint32_t coefficient = 0;
    std::uint32_t residual_rank = 0;
  };

  /// Entries of type `T`, grouped by step.
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

  /// Bases at the row ends or at the column ends of blocks: at the steps in which their clusters
  /// begin, and at those in which they end. Neighbouring ranges of ranks are joined.
  struct Bases {
    ByStep<BasisPart> beginning, ending;
  };

  /// Blocks below the diagonal, in one direction.
  struct Products {
    ByStep<CouplingBlock> couplings;
    ByStep<DenseBlock> dense;
  };

  explicit ClusterSweepPlan(const HierarchicalStorage& storage);

  std::vector<Step> steps;  ///< in the order of the positions
  Bases row_bases, column_bases;
  Products to_beginning_rows;     ///< at the step in which their rows begin
  Products to_beginning_columns;  ///< at the step in which their columns begin
  Products to_ending_columns;     ///< at the step in which their columns end
  Products from_ending_columns;   ///< products with rows, at the step in which the columns end
  std::uint32_t coefficient_count = 0;
  std::size_t largest_scratch = 0;  ///< as in HierarchicalLayout
};

}  // namespace rebounce

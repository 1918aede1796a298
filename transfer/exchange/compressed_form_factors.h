#pragma once

#include <memory>

#include "transfer/exchange/relaxation.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// F as a hierarchical matrix: the symmetric G = A^1/2 F A^-1/2 in the blocks of a
/// HierarchicalOperator, one matrix for the three channels. Only one of a block and its mirror
/// image is stored; gathering uses it for both while it is in cache.
class CompressedFormFactors final : public SweepableFormFactors {
 public:
  /// Shares `exchange` and refers to nothing else. Throws Error if it is null, if its channels have
  /// different matrices, or if its bases are nested.
  explicit CompressedFormFactors(std::shared_ptr<const HierarchicalOperator> exchange);

  std::size_t patch_count() const override { return exchange_->patch_count(); }
  std::size_t bytes() const override { return exchange_->bytes(); }
  std::size_t bytes_per_gather() const override { return exchange_->bytes_per_apply(); }
  std::size_t workspace_size() const override { return exchange_->workspace_size(); }

  /// Block Gauss-Seidel in the order of the clusters, on one thread. Dense diagonal blocks are
  /// relaxed patch by patch, as in sequential Gauss-Seidel. Within low-rank diagonal blocks the
  /// values before the sweep are used.
  ///
  /// A sweep needs the products with both halves of the matrix, each at a different state of the
  /// patches, so it reads the stored half twice. A sweep in the opposite direction of the one
  /// before reads it once: one of the products is left from that sweep (V. Conrad, Y. Wallach,
  /// "Alternating methods for sets of linear equations", 1979).
  std::unique_ptr<Relaxation> make_relaxation() const override;

  const HierarchicalOperator& exchange() const { return *exchange_; }

 private:
  void do_gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                 const Scheduler& scheduler) const override;

  std::shared_ptr<const HierarchicalOperator> exchange_;
};

}  // namespace rebounce

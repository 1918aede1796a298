#pragma once

#include <memory>

#include "transfer/exchange/relaxation.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// F as a hierarchical matrix: G = A^1/2 F A^-1/2, which is symmetric, in the blocks of
/// HierarchicalOperator, one matrix for the three channels. Of a block and its mirror image one is
/// stored; gathering applies both while it is in cache.
class CompressedFormFactors final : public SweepableFormFactors {
 public:
  /// Refers to nothing but `exchange`, which it shares. Throws Error if that is null, its channels
  /// have different matrices or its blocks cluster coefficients.
  explicit CompressedFormFactors(std::shared_ptr<const HierarchicalOperator> exchange);

  std::size_t patch_count() const override { return exchange_->patch_count(); }
  std::size_t bytes() const override { return exchange_->bytes(); }
  std::size_t bytes_per_gather() const override { return exchange_->bytes_per_apply(); }
  std::size_t workspace_size() const override { return exchange_->workspace_size(); }
  void gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
              const Scheduler& scheduler = {}) const override;

  /// Block Gauss-Seidel in the order of the clusters. Dense blocks on the diagonal are relaxed
  /// patch by patch, so that it is sequential Gauss-Seidel but for diagonal blocks of low rank,
  /// inside of which the values before the sweep are used. One thread.
  ///
  /// A sweep needs the products of both halves of the matrix, each when other patches have their
  /// newest values, so that it reads the stored half twice; sweeps that change direction each time
  /// find one of the two still there from the sweep before, and read it once. (V. Conrad, Y.
  /// Wallach, "Alternating methods for sets of linear equations", 1979.)
  std::unique_ptr<Relaxation> make_relaxation() const override;

  const HierarchicalOperator& exchange() const { return *exchange_; }

 private:
  std::shared_ptr<const HierarchicalOperator> exchange_;
};

}  // namespace rebounce

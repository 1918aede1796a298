#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "transfer/operator/transfer_operator.h"

namespace rebounce {

class HierarchicalPlan;
struct HierarchicalLayout;
struct HierarchicalStorage;

/// Y as a hierarchical matrix (W. Hackbusch, "Hierarchical Matrices", 2015): the symmetric form
/// Yhat = A^1/2 Y A^-1/2, its patches in an order that keeps neighbours together, cut into blocks
/// that are dense or of low rank. Of a block and its mirror image one is stored and applied twice.
///
/// The channels share the bases of a low-rank block and have a coupling matrix each: B_c = U S_c
/// V^T, on the diagonal B_c = U S_c U^T. Values of a block:
///   dense     [matrix][row_count][column_count]
///   low-rank  U^T [row_rank][row_count], V^T [column_rank][column_count] (not on the diagonal),
///             S [matrix][row_rank][column_rank]
///   cluster coefficients   W^T [row_rank][row_count]
/// In 8 bits U^T, V^T and W^T have row_residual_rank and column_residual_rank rows more.
///
/// The bases of large blocks are nested (W. Hackbusch and S. Börm, "Data-sparse approximation by
/// adaptive H2-matrices", 2002), in one level: U = W D T, in which W has the bases of cluster
/// coefficients along its diagonal, D their scales, and T, much shorter than U, is what the block
/// holds.
///
/// An apply streams through the values: all bases of a cluster of patches are kept together,
/// whichever blocks they belong to, so that one pass over them takes the light of the cluster to
/// its coefficients, and another the coefficients back to the light that arrives.
///
/// Patches may be equilibrated: the values are then those of K, Yhat = R K R, in which R is
/// diagonal with powers of two, small for patches of whose light little arrives. Integers of a
/// basis have one step for all of its positions, and where it is dark they would be lost in it.
///
/// An operator for some receivers and sources has the blocks that these share, whichever way the
/// light goes; an apply reads them in the ways that are wanted.
class HierarchicalOperator final : public TransferOperator {
 public:
  /// Some of the patches, as `receivers` prepares them for `apply_to`.
  class Receivers {
   public:
    /// Values of the operator that an apply to them reads.
    std::uint64_t value_count() const;

   private:
    friend class HierarchicalOperator;
    explicit Receivers(std::shared_ptr<const HierarchicalPlan> plan) : plan_(std::move(plan)) {}
    std::shared_ptr<const HierarchicalPlan> plan_;
  };

  /// Takes over `storage`; values in the order kByBlock are copied into the order kStreamed. Throws
  /// Error if `patch` is not a permutation, a block reaches outside the matrix, is misplaced or has
  /// a rank above its size, the values do not fit the blocks, or as check_roles does. Whether the
  /// blocks cover the matrix is not looked at.
  explicit HierarchicalOperator(HierarchicalStorage storage);

  const HierarchicalStorage& storage() const { return *storage_; }

  std::size_t patch_count() const override { return gather_scale_.size(); }
  std::size_t bytes() const override;
  /// Bases are read twice, to project light and to expand it.
  std::size_t bytes_per_apply() const override;
  std::string kind() const override { return "hierarchical"; }
  const PatchRoles& roles() const override;
  std::size_t workspace_size() const override { return batch_workspace_size(1); }
  void apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
             std::span<float> workspace, const Scheduler& scheduler = {}) const override;
  std::size_t batch_workspace_size(std::size_t light_count) const override;
  void apply_batch(std::size_t light_count, std::span<const Float3> initial_exitance,
                   std::span<Float3> indirect_irradiance, std::span<float> workspace,
                   const Scheduler& scheduler = {}) const override;
  void expand(int channel, std::span<float> transfer) const override;

  /// Prepares applies to these patches alone, which read only the blocks that reach them or
  /// neighbours within a run of kAlignment positions. Those that are no receivers of the operator
  /// get 0. Allocates. Throws Error if a patch does not exist.
  Receivers receivers(std::span<const std::uint32_t> patches) const;

  /// Like `apply`, but writes the irradiance [n] of the receivers alone, the same as `apply` would
  /// up to rounding; that of the other patches is left as it is.
  void apply_to(const Receivers& receivers, std::span<const Float3> initial_exitance,
                std::span<Float3> indirect_irradiance, std::span<float> workspace,
                const Scheduler& scheduler = {}) const;

 private:
  std::shared_ptr<const HierarchicalPlan> plan_to(const std::vector<bool>& wanted) const;
  void run(const HierarchicalPlan& plan, std::size_t light_count,
           std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
           std::span<float> workspace, const Scheduler& scheduler) const;

  std::shared_ptr<const HierarchicalStorage> storage_;
  /// [n] by position: R A^1/2, 0 of patches that are no sources, and R A^-1/2 times the scale of
  /// the products.
  std::vector<float> gather_scale_, scatter_scale_;
  std::shared_ptr<const HierarchicalLayout> layout_;
  std::shared_ptr<const HierarchicalPlan> plan_;  ///< to all receivers
};

}  // namespace rebounce

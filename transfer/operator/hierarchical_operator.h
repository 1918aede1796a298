#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "transfer/operator/transfer_operator.h"

namespace rebounce {

class HierarchicalPlan;
struct ChannelLanes;
struct HierarchicalLayout;
struct HierarchicalStorage;

/// Y as a hierarchical matrix (W. Hackbusch, "Hierarchical Matrices", 2015). The patches of the
/// symmetric form Yhat = A^1/2 Y A^-1/2 are put into an order that keeps neighbours together, and
/// the matrix is cut into blocks that are dense or of low rank. Only one of a block and its mirror
/// image is stored; an apply uses it for both.
///
/// The channels share the bases of a low-rank block, and each has its own coupling matrix: B_c = U
/// S_c V^T, on the diagonal B_c = U S_c U^T. HierarchicalStorage describes the values.
///
/// The bases of large blocks are nested in one level (W. Hackbusch and S. Börm, "Data-sparse
/// approximation by adaptive H2-matrices", 2002): U = W D T. W has cluster bases along its diagonal
/// and D their scales. T is much shorter than U; the block stores T.
///
/// An apply streams through the values. All bases over one cluster are stored next to each other,
/// whatever blocks they belong to. One pass over them projects the light of the cluster to its
/// coefficients, another expands coefficients to the light that arrives.
///
/// Patches may be equilibrated: the values are then those of K with Yhat = R K R. R is diagonal and
/// holds powers of two, small for patches whose light has little effect. An integer basis vector
/// has one step for all positions; without R, dark positions would be rounded to zero.
///
/// An operator with receivers and sources has the blocks that contain a receiver and a source, in
/// either direction. An apply uses each block only in the directions that are needed.
class HierarchicalOperator final : public TransferOperator {
 public:
  /// A set of patches, prepared by `receivers` for `apply_to`.
  class Receivers {
   public:
    /// The number of values of the operator that an apply to these patches reads.
    std::uint64_t value_count() const;

   private:
    friend class HierarchicalOperator;
    explicit Receivers(std::shared_ptr<const HierarchicalPlan> plan) : plan_(std::move(plan)) {}
    std::shared_ptr<const HierarchicalPlan> plan_;
  };

  /// Takes ownership of `storage`; values in the order kByBlock are copied into the order
  /// kStreamed. Throws Error if `patch` is not a permutation, if a block is misplaced, reaches
  /// outside the matrix or has a rank above its size, if the values do not fit the blocks, or as
  /// check_roles does. It does not check that the blocks cover the matrix.
  explicit HierarchicalOperator(HierarchicalStorage storage);

  const HierarchicalStorage& storage() const { return *storage_; }

  std::size_t patch_count() const override { return gather_scale_.size(); }
  std::size_t bytes() const override;
  /// Bases count twice: an apply reads them to project light and to expand it.
  std::size_t bytes_per_apply() const override;
  /// kLowRank if one block of low rank is all.
  OperatorKind kind() const override;
  const PatchRoles& roles() const override;
  std::size_t workspace_size() const override { return batch_workspace_size(1); }
  std::size_t batch_workspace_size(std::size_t light_count) const override;

  /// Prepares applies to these patches alone. Such an apply reads only the blocks that reach one of
  /// them or a neighbour in the same run of kAlignment positions. Patches that are no receivers of
  /// the operator get 0. Allocates. Throws Error if a patch does not exist.
  Receivers receivers(std::span<const std::uint32_t> patches) const;

  /// Like `apply`, but writes the irradiance [n] only at `receivers`, which are of this operator.
  /// It equals that of `apply` up to rounding. The other entries are left unchanged.
  void apply_to(const Receivers& receivers, std::span<const Float3> initial_exitance,
                std::span<Float3> indirect_irradiance, std::span<float> workspace,
                const Scheduler& scheduler = {}) const;

 private:
  void do_apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
                std::span<float> workspace, const Scheduler& scheduler) const override;
  void do_apply_batch(std::size_t light_count, std::span<const Float3> initial_exitance,
                      std::span<Float3> indirect_irradiance, std::span<float> workspace,
                      const Scheduler& scheduler) const override;
  void do_apply_planes(std::optional<int> channel, std::span<const float> initial_exitance,
                       std::span<float> indirect_irradiance, std::span<float> workspace,
                       const Scheduler& scheduler) const override;
  void do_expand(int channel, std::span<float> transfer) const override;

  std::shared_ptr<const HierarchicalPlan> plan_to(const std::vector<bool>& wanted) const;
  ChannelLanes all_lanes() const;
  template <typename From, typename To>
  void run(const HierarchicalPlan& plan, std::size_t light_count, const ChannelLanes& lanes,
           const From& initial_exitance, const To& indirect_irradiance, std::span<float> workspace,
           const Scheduler& scheduler) const;

  std::shared_ptr<const HierarchicalStorage> storage_;
  /// [n] by position: R A^1/2, or 0 for patches that are no sources; and R A^-1/2 times the scale
  /// of the products.
  std::vector<float> gather_scale_, scatter_scale_;
  std::shared_ptr<const HierarchicalLayout> layout_;
  std::shared_ptr<const HierarchicalPlan> plan_;  ///< for all receivers
};

}  // namespace rebounce

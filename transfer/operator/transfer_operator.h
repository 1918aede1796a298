#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "rebounce/operators.h"
#include "rebounce/scene_data.h"
#include "rebounce/types.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Y = F (I - rho F)^-1, one matrix per colour channel. H = Y M0: from the initial exitance it
/// gives the complete indirect irradiance.
///
/// An operator is immutable. Any number of threads may apply it at the same time, each with a
/// workspace of its own.
class TransferOperator {
 public:
  virtual ~TransferOperator() = default;

  virtual std::size_t patch_count() const = 0;

  /// The receivers and sources that the operator serves. It gives no irradiance at patches that are
  /// no receivers and ignores light of patches that are no sources. By default every patch is both.
  virtual const PatchRoles& roles() const;

  /// Bytes of the stored operator, all three channels.
  virtual std::size_t bytes() const = 0;

  /// Bytes that an apply to one light reads; bytes that it reads twice count twice.
  virtual std::size_t bytes_per_apply() const { return bytes(); }

  /// Of kOperatorKinds.
  virtual OperatorKind kind() const = 0;

  /// Floats of workspace that `apply` needs.
  virtual std::size_t workspace_size() const = 0;

  /// Writes the indirect irradiance [n] in lx that follows from `initial_exitance` [n] in lx.
  /// Patches that are no receivers get 0; light of patches that are no sources has no effect. The
  /// two arrays must not overlap. `workspace` has at least workspace_size() floats and is
  /// overwritten. Does not allocate or lock. Gives the same bits for any `scheduler`; without one,
  /// little work stays on this thread. Throws Error if a size is wrong, as the functions below do.
  void apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
             std::span<float> workspace, const Scheduler& scheduler = {}) const;

  /// Floats of workspace that `apply_batch` needs for `light_count` lights.
  virtual std::size_t batch_workspace_size(std::size_t light_count) const;

  /// Applies the operator to several lights, one after the other in both arrays, [light_count][n].
  /// The result equals that of single applies up to rounding. Operators that can read their values
  /// once for several lights are faster here than single applies; the default is single applies.
  void apply_batch(std::size_t light_count, std::span<const Float3> initial_exitance,
                   std::span<Float3> indirect_irradiance, std::span<float> workspace,
                   const Scheduler& scheduler = {}) const;

  /// Applies the operator to planes of light, each of one channel: [plane_count][n] in both arrays.
  /// Plane v is channel v mod 3 of light v / 3; with `channel`, 0 to 2, all planes are of that
  /// channel, and three take about as long as one light. `workspace` has
  /// batch_workspace_size(lights) floats, with three planes or fewer to a light. The result equals
  /// that of `apply` up to rounding. May allocate. Throws Error as above, if a light lacks a plane
  /// and no channel is given, and if there is no such channel.
  void apply_planes(std::optional<int> channel, std::span<const float> initial_exitance,
                    std::span<float> indirect_irradiance, std::span<float> workspace,
                    const Scheduler& scheduler = {}) const;

  /// Writes Y for one channel, dense, unscaled and row-major [n][n], for export and tests. The
  /// default multiplies with n unit vectors.
  void expand(int channel, std::span<float> transfer) const;

 private:
  // Small products stay on the calling thread.
  Scheduler scheduler_for(std::size_t light_count, const Scheduler& scheduler) const;

  // What the functions above do once they have looked at the sizes.
  virtual void do_apply(std::span<const Float3> initial_exitance,
                        std::span<Float3> indirect_irradiance, std::span<float> workspace,
                        const Scheduler& scheduler) const = 0;
  virtual void do_apply_batch(std::size_t light_count, std::span<const Float3> initial_exitance,
                              std::span<Float3> indirect_irradiance, std::span<float> workspace,
                              const Scheduler& scheduler) const;
  virtual void do_expand(int channel, std::span<float> transfer) const;
  virtual void do_apply_planes(std::optional<int> channel, std::span<const float> initial_exitance,
                               std::span<float> indirect_irradiance, std::span<float> workspace,
                               const Scheduler& scheduler) const;
};

/// Returns the indirect irradiance [n] in lx that follows from `initial_exitance` [n] in lx.
/// Allocates.
std::vector<Float3> product(const TransferOperator& transfer,
                            std::span<const Float3> initial_exitance);

}  // namespace rebounce

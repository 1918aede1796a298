#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "transfer/base/parallel.h"
#include "transfer/base/types.h"
#include "transfer/data/patch_roles.h"

namespace rebounce {

/// Y = F (I - rho F)^-1: takes the light that leaves the patches the first time to the complete
/// indirect light that arrives at them, H = Y M0, one matrix per colour channel.
///
/// An operator is immutable: any number of threads may apply one at the same time, each with a
/// workspace of its own.
class TransferOperator {
 public:
  virtual ~TransferOperator() = default;

  virtual std::size_t patch_count() const = 0;

  /// Whom it serves: it says nothing of what arrives at patches that are no receivers, nor of what
  /// the light of patches that are no sources does. By default every patch is both.
  virtual const PatchRoles& roles() const;

  /// Bytes of the stored operator, all three channels.
  virtual std::size_t bytes() const = 0;

  /// Bytes of it that an apply to one light reads, those that it reads twice counted twice.
  virtual std::size_t bytes_per_apply() const { return bytes(); }

  /// The kind as the command line names it: "dense", "hierarchical", "low-rank".
  virtual std::string kind() const = 0;

  /// Floats of workspace that `apply` needs.
  virtual std::size_t workspace_size() const = 0;

  /// Writes the indirect irradiance [n][3] in lx that `initial_exitance` [n][3] in lx gives rise
  /// to: at receivers, of the light of sources; 0 at other patches, and the light of others does
  /// nothing. The two must not overlap; `workspace` has at least workspace_size() floats and is
  /// overwritten. Neither allocates nor locks; the same bits for any `scheduler`.
  virtual void apply(std::span<const Float3> initial_exitance,
                     std::span<Float3> indirect_irradiance, std::span<float> workspace,
                     const Scheduler& scheduler = {}) const = 0;

  /// Floats of workspace that a batch of `light_count` needs.
  virtual std::size_t batch_workspace_size(std::size_t light_count) const;

  /// Does what `apply` does for several lights, one after the other in both arrays,
  /// [light_count][n][3]; cheaper where the operator can make its values serve several of them.
  /// The same as that many applies up to rounding; by default it is that many.
  virtual void apply_batch(std::size_t light_count, std::span<const Float3> initial_exitance,
                           std::span<Float3> indirect_irradiance, std::span<float> workspace,
                           const Scheduler& scheduler = {}) const;

  /// Writes Y itself, row-major [n][n], for one channel: dense, unscaled, for export and tests. By
  /// default n products with unit vectors.
  virtual void expand(int channel, std::span<float> transfer) const;
};

/// The indirect irradiance [n] in lx that `initial_exitance` [n] in lx gives rise to, for once: it
/// allocates.
std::vector<Float3> product(const TransferOperator& transfer,
                            std::span<const Float3> initial_exitance);

}  // namespace rebounce

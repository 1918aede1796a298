#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "rebounce/types.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// F as an operator that gathers, whatever its storage. Gathering, conjugate gradients and
/// refinement need nothing else.
///
/// An operator is immutable. Any number of threads may use it at the same time, each with a
/// workspace of its own.
class FormFactorOperator {
 public:
  virtual ~FormFactorOperator() = default;

  virtual std::size_t patch_count() const = 0;

  /// Bytes of the stored F.
  virtual std::size_t bytes() const = 0;

  /// Bytes of F that one gather reads; bytes that it reads twice count twice.
  virtual std::size_t bytes_per_gather() const { return bytes(); }

  /// Floats of workspace that `gather` needs.
  virtual std::size_t workspace_size() const = 0;

  /// Gathers: out(i) = sum over j of F(i,j) in(j), [n] each. `out` must not overlap `in`.
  /// `workspace` has at least workspace_size() floats and is overwritten. Does not allocate or
  /// lock. Gives the same bits for any `scheduler`. Throws Error if a size is wrong.
  void gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
              const Scheduler& scheduler = {}) const;

 private:
  /// What gather does once it has looked at the sizes.
  virtual void do_gather(std::span<const Float3> in, std::span<Float3> out,
                         std::span<float> workspace, const Scheduler& scheduler) const = 0;
};

/// Returns the gathered [n] of `in` [n]. Allocates.
std::vector<Float3> gather(const FormFactorOperator& form_factors, std::span<const Float3> in);

}  // namespace rebounce

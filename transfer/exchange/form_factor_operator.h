#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "transfer/base/parallel.h"
#include "transfer/base/types.h"

namespace rebounce {

/// F as something that gathers, whatever it is stored as: all that gathering, conjugate gradients
/// and refinement need to know of it.
///
/// An operator is immutable: any number of threads may use one at the same time, each with a
/// workspace of its own.
class FormFactorOperator {
 public:
  virtual ~FormFactorOperator() = default;

  virtual std::size_t patch_count() const = 0;

  /// Bytes of F as it is stored.
  virtual std::size_t bytes() const = 0;

  /// Bytes that one gather reads of F, what it reads twice counted twice.
  virtual std::size_t bytes_per_gather() const { return bytes(); }

  /// Floats of workspace that `gather` needs.
  virtual std::size_t workspace_size() const = 0;

  /// Gathers: out(i) = sum over j of F(i,j) in(j), each of [n][3]. `out` must not overlap `in`;
  /// `workspace` has at least workspace_size() floats and is overwritten. Neither allocates nor
  /// locks; the same bits for any `scheduler`.
  virtual void gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                      const Scheduler& scheduler = {}) const = 0;
};

/// What `form_factors` gather of `in` [n], for once: it allocates.
std::vector<Float3> gather(const FormFactorOperator& form_factors, std::span<const Float3> in);

}  // namespace rebounce

#pragma once

#include "precompute/build/build_report.h"
#include "precompute/build/build_settings.h"
#include "precompute/build/phase_clock.h"
#include "precompute/inverse/dense_transfer.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/data/patch_roles.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

// The last stage of a build: makes the operator of `data`, whose patches, mesh and form factors are
// there, measures it, and records it all. `decided`: settings that leave nothing open; `roles`: of
// the patches, other than all of both only if the operator is to be hierarchical. Throws Error if
// the operator fails its own check, Cancelled if asked to stop.

/// The operator's tolerance over that of the compressed form factors that it is made from, whose
/// error it has beside its own.
inline constexpr double kToleranceOverFormFactors = 5;

/// In what the dense inverse is made that an operator of this kind comes from.
inline Arithmetic arithmetic_of(OperatorKind kind) {
  return kind == OperatorKind::kDense ? Arithmetic::kDouble : Arithmetic::kSingle;
}

/// From data.exchange, by a dense inverse.
void make_operator_from_pairs(const RayTracer& tracer, const BuildSettings& decided,
                              const PatchRoles& roles, TransferData& data, BuildReport& report,
                              PhaseClock& clock);

/// From data.links, which stay only if that was asked for: F is compressed, and what is then
/// solved for is never there as a whole (matrix_free_transfer.h). The error is measured against the
/// links, which know nothing of either compression. A tolerance of form factors that is still 0 is
/// as much less than usual as receivers get less than all of the light.
void make_operator_from_links(const RayTracer& tracer, const BuildSettings& decided,
                              const PatchRoles& roles, TransferData& data, BuildReport& report,
                              PhaseClock& clock);

}  // namespace rebounce

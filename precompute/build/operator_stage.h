#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/build/build_record.h"
#include "precompute/build/phase_clock.h"
#include "precompute/inverse/dense_transfer.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "rebounce/scene_data.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

// The last stage of a build: makes the operator of `data`, whose patches, mesh and form factors are
// complete, measures its error, records that, and returns it for record_build. `decided`: settings
// that leave nothing open. `roles`: roles of the patches; anything but both for all patches needs a
// hierarchical operator. Throws Error if the operator fails its own check, Cancelled if asked to
// stop.

/// The tolerance of the operator over that of the compressed form factors that it is made from.
/// Their error adds to its own.
inline constexpr double kToleranceOverFormFactors = 2.5;  // lab/183

/// Lower limit of the tolerance of form factors in half precision, whose rounding error is not far
/// below.
inline constexpr double kLeastFormFactorTolerance = 1e-4;

/// The parts of the tolerance that links and the compression of an operator from links may take.
/// Their errors are independent of each other, so that the squares of the parts add up to 1. Finer
/// links cost time offline, finer operators bytes and time in each frame.
inline constexpr double kLinksPart = 0.6, kCompressionPart = 0.8;

/// Lights that compressed form factors are measured under.
inline constexpr int kFormFactorLightCount = 16;

/// The seed of a second check, whose lights a first one with `seed` has not seen.
inline std::uint64_t seed_of_second_check(std::uint64_t seed) {
  return ~seed;
}

/// The precision of the dense inverse that an operator of this kind is made from.
inline Arithmetic arithmetic_of(OperatorKind kind) {
  return kind == OperatorKind::kDense ? Arithmetic::kDouble : Arithmetic::kSingle;
}

/// Makes it from data.exchange, by a dense inverse.
std::vector<KindError> make_operator_from_pairs(const RayTracer& tracer,
                                                const BuildSettings& decided,
                                                const PatchRoles& roles, TransferData& data,
                                                BuildReport& report, PhaseClock& clock);

/// Makes it from `links`; `fewer` are chosen again from them (fit_links), or empty: then they are
/// found here. They go into data.links on request. F is compressed, and the inverse is solved for
/// without being stored as a whole (matrix_free_transfer.h). The error is measured against the
/// links, which neither compression affects; an operator that errs too much under a single lamp is
/// compressed once more, finer. If no tolerance of form factors is set, it is reduced by the
/// fraction of the light that receivers get. How far links and operator together are from exact
/// form factors is estimated by rays; `shown_patch` [t] is that of PatchModel. The memory limit of
/// `decided` is for what comes on top of what the process held before links.
std::vector<KindError> make_operator_from_links(std::shared_ptr<const LinkedFormFactors> links,
                                                FormFactorLinks fewer, const RayTracer& tracer,
                                                std::span<const std::uint32_t> shown_patch,
                                                const BuildSettings& decided,
                                                const PatchRoles& roles, TransferData& data,
                                                BuildReport& report, PhaseClock& clock);

}  // namespace rebounce

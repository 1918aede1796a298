#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "precompute/base/progress.h"
#include "rebounce/build_report.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// What the light of `links` is off by under a few point lights, for a decision: a quarter
/// of the lights and half of the rays of the check. `fewer` are chosen again from these links
/// (fit_links): light is solved for along them, and corrected by the links. Memory and other
/// arguments are those of WholeErrorEstimator. Throws Cancelled if asked to stop.
SampledError error_of_links(const std::shared_ptr<const LinkedFormFactors>& links,
                            const FormFactorLinks& fewer, const TransferData& data,
                            std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                            const PatchRoles& roles, std::uint64_t seed,
                            const Progress& progress = {});

}  // namespace rebounce

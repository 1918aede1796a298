#pragma once

#include <cstdint>
#include <vector>

#include "precompute/exchange/pairs/form_factors.h"

namespace rebounce::bench {

/// The rays that the form-factor phase traces for some rows, untraced, one stream for each call
/// that the phase makes.
struct StageRays {
  std::vector<std::vector<Ray>> shadow, escape;
  std::uint64_t shadow_count = 0, escape_count = 0;
  std::uint64_t hidden_count = 0;  ///< shadow rays that meet something
};

/// Makes those of every `row_step`-th row: the probe rays of all pairs, all rays of the pairs that
/// are partly hidden, and the escape rays. Rows that the phase doubts and traces again are left
/// out.
StageRays make_stage_rays(const PatchModel& model, const RayTracer& tracer,
                          const FormFactorSettings& settings, std::uint32_t row_step);

}  // namespace rebounce::bench

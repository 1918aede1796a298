#pragma once

#include <cstdint>
#include <vector>

#include "precompute/exchange/pairs/form_factors.h"

namespace rebounce::bench {

/// Form factors by so many rays that their noise does not matter, found in two ways that share
/// neither rays nor formulas.
struct ExchangeReference {
  /// [n][n] m²: the kernel of each pair times the pooled visibility of shadow rays between ever new
  /// points; near pairs that are partly hidden or of many triangles by pooled hemisphere rays. No
  /// closure.
  std::vector<double> exchange_area;
  /// [n] the gather F B of `radiosity` by hemisphere rays alone.
  std::vector<double> gathered;
  double gather_noise = 0;  ///< relative area-weighted L2 error of `gathered`, from its two halves
};

/// Takes about `factor` times the rays of the default settings, by other seeds: pairs of which 256
/// rays or more all agree, with the hemisphere rays too, are not asked again.
ExchangeReference make_exchange_reference(const PatchModel& model, const RayTracer& tracer,
                                          const std::vector<double>& radiosity, int factor);

}  // namespace rebounce::bench

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/facets/view_factors.h"

namespace rebounce {

/// Exchange factors of B. Gebhart, "Surface temperature calculations in radiant surroundings of
/// arbitrary complexity" (1961): the fraction of what facet i emits that facet j absorbs in the
/// end, after all reflections. With the emissivity e, the reflectance 1 - e and
/// Y = F (I - rho F)^-1 it is Y(i, j) e(j). Every row and its sky and what is blocked are 1.
struct ExchangeFactors {
  std::vector<float> factor;  ///< [n][n]
  std::vector<double> sky;    ///< [n] fraction that leaves in the end
};

/// Throws Error if exchange factors cannot be computed for `n` facets: the number of emissivities
/// is another, one is not in [0.01, 1], or the factors and the dense inverse do not fit into the
/// memory of this machine.
void check_exchange(std::size_t n, std::span<const double> emissivity);

/// `emissivity` [n]. Throws Error as check_exchange does, and if
/// area(i) F(i, j) = area(j) F(j, i) does not hold to four digits; Cancelled if asked to stop. Time
/// grows with n³, memory with n².
ExchangeFactors compute_exchange_factors(const ViewFactors& factors,
                                         std::span<const double> emissivity,
                                         const Progress& progress = {});

}  // namespace rebounce

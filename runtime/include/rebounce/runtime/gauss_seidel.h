#pragma once

#include <cstddef>
#include <span>

#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/types.h"

namespace rebounce {

struct GaussSeidelSettings {
  int max_sweeps = 100;    ///< at most this many sweeps, at least 1
  double residual = 1e-6;  ///< stop at this part of M0, area-weighted L2; 0: only the sweeps count
};

struct GaussSeidelResult {
  int sweeps = 0;
  /// Area-weighted |change of the last sweep| / |M0|: each row's change is its residual at the time
  /// it is reached, so this bounds the residual that is left.
  double residual = 0;
};

/// Solves (I - rho F) B = M0 by Gauss-Seidel relaxation (seed, chapter 8): patch after patch,
/// B(i) = M0(i) + rho(i) sum over j of F(i,j) B(j), always with the newest values.
///
/// `radiosity` [n] is where it starts (zero, or the last frame's solution) and where the solution
/// goes. Sweeps run on one thread, in the order of the patches. Does not allocate. Throws Error on
/// sizes that do not agree.
GaussSeidelResult solve_gauss_seidel(const FormFactorRows& form_factors,
                                     std::span<const Float3> reflectance,
                                     std::span<const float> area,
                                     std::span<const Float3> initial_exitance,
                                     const GaussSeidelSettings& settings,
                                     std::span<Float3> radiosity);

}  // namespace rebounce

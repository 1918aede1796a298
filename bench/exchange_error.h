#pragma once

#include <array>
#include <span>
#include <vector>

#include "precompute/patches/patch_model.h"
#include "transfer/exchange/exchange_matrix.h"

namespace rebounce::bench {

/// [n][n] m², both triangles.
std::vector<double> dense_exchange(const ExchangeMatrix& exchange);

/// The gather F B: rows of `exchange` [n][n] by `radiosity` [n], over `area`.
std::vector<double> gather(std::span<const double> exchange, std::span<const float> area,
                           std::span<const double> radiosity);

/// Relative area-weighted L2 error of light `found` [n] against `truth` [n].
double light_error(std::span<const double> found, std::span<const double> truth,
                   std::span<const float> area);

/// |G' - G| / |G|, Frobenius, of G = A^1/2 F A^-1/2 from exchange areas [n][n].
double form_factor_error(std::span<const double> found, std::span<const double> truth,
                         std::span<const float> area);

/// Ranks of the far blocks of G, for several matrices [n][n] of exchange areas at once: pairs of
/// clusters no nearer than the larger is wide. A rank leaves out singular values whose squares add
/// up to the square of kRankTolerance of the block's norm.
inline constexpr double kRankTolerance = 1e-3;
struct FarRanks {
  std::size_t block_count = 0;
  std::vector<double> mean_rank;  ///< of each matrix
};
struct FarRanksByVisibility {
  FarRanks clear;  ///< blocks that are the same in all matrices to 1e-3: nothing is partly hidden
  FarRanks mixed;  ///< all others
};
FarRanksByVisibility far_ranks(const PatchModel& model,
                               std::span<const std::vector<double>> matrices);

}  // namespace rebounce::bench

#pragma once

#include <array>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Solves the radiosity system in double precision by conjugate gradients: the reference that
/// faster methods are measured against.
///
/// B = M0 + R z with R = rho^1/2 and (I - R F R) z = R F M0, positive definite in the area-weighted
/// inner product as long as no reflectance is 1; black patches have z = 0
/// (notes/concepts/solvers.md). The residual is that of (I - rho F) B = M0, recomputed from the
/// solution at the end. The bits do not depend on the number of threads.
class ReferenceSolver {
 public:
  using Double3 = std::array<double, 3>;

  /// The number of lights for which F is read together: their sums just fill the registers.
  static constexpr int kBatchLights = 8;

  /// The form of F in the system: pairs, links, or compressed.
  using Form =
      std::variant<FormFactorRows, std::shared_ptr<const LinkedFormFactors>, CompressedFormFactors>;

  /// Compressed form factors gather in single precision: no solution with them has a smaller
  /// residual than this, whatever residual is requested.
  static constexpr double kSinglePrecisionResidual = 1e-6;

  /// `patches` must outlive the solver. Throws Error if sizes do not agree.
  ReferenceSolver(const ExchangeMatrix& exchange, const PatchTable& patches);
  ReferenceSolver(const FormFactorLinks& links, const PatchTable& patches);

  /// With links that other objects share.
  ReferenceSolver(std::shared_ptr<const LinkedFormFactors> links, const PatchTable& patches);

  /// With the best F that `data` holds: pairs, else links, else compressed form factors. `data`
  /// must outlive the solver. Throws Error if it holds none of them.
  explicit ReferenceSolver(const TransferData& data);

  /// Solves (I - rho F) B = M0 until the area-weighted residual is at most `residual` times that of
  /// M0 (default 1e-10); returns the radiosity B [n] in lx. Throws Error if 10,000 steps do not
  /// reach it.
  std::vector<Double3> radiosity(std::span<const Float3> initial_exitance,
                                 double residual = 1e-10) const;

  /// The same for many lights [n each], kBatchLights at a time: several times faster.
  std::vector<std::vector<Double3>> radiosities(
      std::span<const std::vector<Float3>> initial_exitances, double residual = 1e-10) const;

  /// H = F B [n] in lx for that solution.
  std::vector<Float3> indirect_irradiance(std::span<const Float3> initial_exitance,
                                          double residual = 1e-10) const;

  /// The same for many lights. A light also counts as solved if its residual is at most
  /// `of_reflected_light` times rho H, so that the light that arrives is as exact for a lamp in a
  /// closet as for one in the room.
  std::vector<std::vector<Float3>> indirect_irradiances(
      std::span<const std::vector<Float3>> initial_exitances, double residual = 1e-10,
      double of_reflected_light = 0) const;

 private:
  const PatchTable& patches_;
  Form form_;
};

/// Converts a solution [n] to single precision.
std::vector<Float3> rounded(std::span<const ReferenceSolver::Double3> solution);

}  // namespace rebounce

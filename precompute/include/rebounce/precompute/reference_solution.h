#pragma once

#include <array>
#include <span>
#include <vector>

#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// The radiosity system in double precision, solved by Gauss-Seidel: the truth that everything
/// faster is measured against.
class ReferenceSolver {
 public:
  using Double3 = std::array<double, 3>;

  ReferenceSolver(const ExchangeMatrix& exchange, const PatchTable& patches);

  /// Solves (I - rho F) B = M0 until the area-weighted residual is `residual` of M0 (default
  /// 1e-10); returns the radiosity B [n] in lx. Throws Error if 10,000 sweeps do not get there.
  std::vector<Double3> radiosity(std::span<const Float3> initial_exitance,
                                 double residual = 1e-10) const;

  /// H = F B [n] in lx for that solution.
  std::vector<Float3> indirect_irradiance(std::span<const Float3> initial_exitance,
                                          double residual = 1e-10) const;

 private:
  Double3 gather_row(std::size_t row, const std::vector<Double3>& radiosity) const;

  const PatchTable& patches_;
  FormFactorRows rows_;
};

}  // namespace rebounce

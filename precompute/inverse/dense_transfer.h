#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "precompute/base/arithmetic.h"
#include "precompute/base/progress.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce {

/// Builds Y = F (I - rho F)^-1 for each channel, dense.
///
/// With G = A^1/2 F A^-1/2 and R = rho^1/2, the matrix I - R G R is symmetric positive definite,
/// and (I - R G R)^-1 = I + R Yhat R gives Yhat = A^1/2 Y A^-1/2. The reflectance is raised to at
/// least 1e-7: the division by R is then safe for black patches, and Y changes by less than 1e-7.
///
/// Single precision is enough. The system is an M-matrix, positive on its diagonal only, so no sum
/// off the diagonal cancels. A pivot stays above 1 - rho, 0.01 or more. So an entry keeps its
/// relative error, however small the reflectances by which it is divided (A. S. Alfa, J. Xue and
/// Q. Ye, "Entrywise perturbation theory for diagonally dominant M-matrices with applications",
/// 2002). Only the 1 on the diagonal cancels; the diagonal follows from the other entries by
/// Yhat = G + G R² Yhat.
///
/// Channels with the same reflectances share one matrix. Throws Cancelled if asked to stop.
std::shared_ptr<const DenseOperator> build_dense_transfer(
    const ExchangeMatrix& exchange, const PatchTable& patches, Precision precision,
    const Progress& progress = {}, Arithmetic arithmetic = Arithmetic::kDouble);

/// Bytes that build_dense_transfer holds at its peak: the matrix that is inverted and the operator.
std::size_t dense_transfer_peak_bytes(std::size_t patch_count, std::size_t matrix_count,
                                      Arithmetic arithmetic);

/// Floating-point operations per second of a few products of tiles, with all OpenMP threads.
double measure_tile_speed(Arithmetic arithmetic);

/// Forecasts the seconds that build_dense_transfer takes on a machine of that `tile_speed`. The
/// forecast leaves out all work but the products of tiles: it is rough and rather too low.
double forecast_dense_transfer(std::size_t patch_count, std::size_t matrix_count,
                               double tile_speed);

/// Number of different reflectance channels, 1 to 3; writes which of them each channel uses.
std::uint32_t distinct_channels(std::span<const Float3> reflectance,
                                std::array<std::uint32_t, kChannelCount>& channel_matrix);
std::uint32_t distinct_channels(std::span<const Float3> reflectance);

/// The largest relative area-weighted L2 residual of Y (I - rho F) v = F v over a few random v.
double transfer_residual(const TransferOperator& transfer, const FormFactorOperator& form_factors,
                         const PatchTable& patches);
double transfer_residual(const TransferOperator& transfer, const ExchangeMatrix& exchange,
                         const PatchTable& patches);

}  // namespace rebounce

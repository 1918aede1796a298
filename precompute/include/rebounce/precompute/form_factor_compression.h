#pragma once

#include <memory>
#include <span>
#include <vector>

#include "rebounce/precompute/hierarchical_transfer.h"
#include "rebounce/precompute/measured_error.h"
#include "rebounce/precompute/progress.h"
#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/hierarchical_operator.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// Compresses the form factors as build_hierarchical_transfer compresses Y: G = A^1/2 F A^-1/2, one
/// matrix for the three channels. The error that `settings.tolerance` bounds is that of F B,
/// relative and area-weighted L2, in the mean over `test_radiosities`, each B [n] in lx. If that is
/// not reached, the result is the most exact that was found: measure it. Throws Cancelled if asked
/// to stop.
std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const ExchangeMatrix& exchange, const PatchTable& patches,
    std::span<const std::vector<Float3>> test_radiosities, const HierarchicalSettings& settings,
    const Progress& progress = {});

/// Relative area-weighted L2 errors of `compressed` form factors, in F B for each of these B.
MeasuredError form_factor_error(const HierarchicalOperator& compressed,
                                const ExchangeMatrix& exchange, const PatchTable& patches,
                                std::span<const std::vector<Float3>> radiosities);

/// The radiosities B = M0 + rho Y M0 [n] in lx that `initial_exitances` M0 give rise to.
std::vector<std::vector<Float3>> radiosities_of(
    const TransferOperator& transfer, std::span<const Float3> reflectance,
    std::span<const std::vector<Float3>> initial_exitances);

}  // namespace rebounce

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/compression/hierarchical_settings.h"
#include "precompute/lights/fitting_lights.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// Relative area-weighted L2 errors of the light that is gathered, F B. Lights from which nothing
/// arrives (arrives_nowhere) have none.
struct FormFactorError {
  double mean = 0;
  double max = 0;
  int light_count = 0;  ///< with an error
  int dark_count = 0;   ///< left out
};

/// Compresses the form factors as build_hierarchical_transfer compresses Y: G = A^1/2 F A^-1/2, one
/// matrix for the three channels. What lights are there are radiosities B here, [n] in lx, and the
/// error that `settings.tolerance` bounds is that of F B. If it is not reached, the result is the
/// most exact that was found: measure it. Throws Cancelled if asked to stop.
std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const ExchangeMatrix& exchange, const PatchTable& patches, const FittingLights& radiosities,
    const HierarchicalSettings& settings, const Progress& progress = {});

/// The same from links, without the pairs that they stand for: the cost is that of the links and of
/// a look at each entry for every multiplier that is tried, the memory that of a few pieces of the
/// matrix. Throws Error if `links` are not of these patches.
std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const FormFactorLinks& links, const PatchTable& patches, const FittingLights& radiosities,
    const HierarchicalSettings& settings, const Progress& progress = {});

/// The same with `product`, those links as they gather, which others use too.
std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const FormFactorLinks& links, std::shared_ptr<const LinkedFormFactors> product,
    const PatchTable& patches, const FittingLights& radiosities,
    const HierarchicalSettings& settings, const Progress& progress = {});

/// Errors of `compressed` form factors, against `exact` ones, over these B.
FormFactorError form_factor_error(const HierarchicalOperator& compressed,
                                  const FormFactorOperator& exact, const PatchTable& patches,
                                  std::span<const std::vector<Float3>> radiosities);

/// The radiosities B = M0 + rho Y M0 [n] in lx that `initial_exitances` M0 give rise to.
std::vector<std::vector<Float3>> radiosities_of(
    const TransferOperator& transfer, std::span<const Float3> reflectance,
    std::span<const std::vector<Float3>> initial_exitances);

/// Those of fitting lights through data.transfer: what compress_form_factors is fitted to.
DrawnLights radiosities_of(const DrawnLights& lights, const TransferData& data);

}  // namespace rebounce

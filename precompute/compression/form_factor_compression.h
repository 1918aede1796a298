#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/compression/hierarchical_settings.h"
#include "precompute/lights/fitting_lights.h"
#include "rebounce/build_report.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// Compresses the form factors as build_hierarchical_transfer compresses Y: G = A^1/2 F A^-1/2, one
/// matrix for the three channels. The lights are radiosities B, [n] in lx, and `settings.tolerance`
/// bounds the error of F B. If the tolerance is not reached, the result is the most exact operator
/// that was found: measure it. Throws Cancelled if asked to stop.
std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    const ExchangeMatrix& exchange, const PatchTable& patches, FittingLights radiosities,
    const HierarchicalSettings& settings, const Progress& progress = {});

/// The same from links, without storing the pairs that they stand for. Each multiplier that is
/// tried reads every entry once; the memory is that of a few pieces of the matrix. Blocks are of
/// one `group` on each side (group_patches; empty: all patches are of one).
std::shared_ptr<const HierarchicalOperator> compress_form_factors(
    std::shared_ptr<const LinkedFormFactors> links, const PatchTable& patches,
    std::vector<std::uint8_t> group, FittingLights radiosities,
    const HierarchicalSettings& settings, const Progress& progress = {});

/// The group of each patch, [n], by the form factors that links stand for (patch_groups.h).
std::vector<std::uint8_t> group_patches(std::shared_ptr<const LinkedFormFactors> links,
                                        const PatchTable& patches, const Progress& progress = {});

/// Errors of the `compressed` form factors against `exact` ones, for these radiosities B.
FormFactorError form_factor_error(const HierarchicalOperator& compressed,
                                  const FormFactorOperator& exact, const PatchTable& patches,
                                  std::span<const std::vector<Float3>> radiosities);

/// The radiosities B = M0 + rho Y M0, [n] in lx, for initial exitances M0.
std::vector<std::vector<Float3>> radiosities_of(
    const TransferOperator& transfer, std::span<const Float3> reflectance,
    std::span<const std::vector<Float3>> initial_exitances);

/// The radiosities of fitting lights through data.transfer: the training and validation data of
/// compress_form_factors.
FittingLights radiosities_of(const FittingLights& lights, const TransferData& data);

}  // namespace rebounce

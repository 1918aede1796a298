#pragma once

#include <span>
#include <string>

#include "precompute/compression/hierarchical_settings.h"
#include "precompute/compression/matrix_free_plan.h"
#include "precompute/lights/fitting_lights.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// A hash of all that the couplings of build_matrix_free_transfer depend on; `numbers`: what it has
/// chosen itself.
std::string identity_of_couplings(const HierarchicalOperator& form_factors,
                                  const PatchTable& patches,
                                  std::span<const std::vector<Float3>> training,
                                  const MatrixFreeTransferSettings& settings,
                                  std::span<const double> numbers);

/// A hash of all that the rounds of its search depend on; `couplings`: identity_of_couplings.
std::string identity_of_rounds(const std::string& couplings,
                               std::span<const std::vector<Float3>> validation,
                               const HierarchicalSettings& settings);

}  // namespace rebounce

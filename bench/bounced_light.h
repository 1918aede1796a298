#pragma once

#include "precompute/lights/fitting_lights.h"
#include "transfer/exchange/form_factor_operator.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// The radiosities after two reflections of `lights`, by `form_factors` of the `patches`: near
/// enough to the whole for compressed form factors to be fitted to, and in closed scenes of any
/// reflectance quick to have.
DrawnLights bounced(const DrawnLights& lights, const FormFactorOperator& form_factors,
                    const PatchTable& patches);

}  // namespace rebounce::bench

#pragma once

#include <memory>

#include "rebounce/solvers.h"
#include "transfer/exchange/form_factor_operator.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The form factors of a file, in the form that is fastest for `method`. Throws Error, with the
/// option of precompute that stores them, if the file has none of this source.
std::unique_ptr<const FormFactorOperator> take_form_factors(const TransferData& data,
                                                            SolveMethod method,
                                                            FormFactorSource source);

}  // namespace rebounce

#pragma once

#include <memory>

#include "precompute/base/progress.h"
#include "precompute/compression/matrix_free_plan.h"
#include "precompute/lights/fitting_lights.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// Builds Y = F (I - rho F)^-1, compressed, without any matrix of all pairs: the columns of Yhat
/// are solved for by conjugate gradients, a panel of neighbouring patches at a time, and each panel
/// is compressed finely as soon as it is there. The operator that this leaves, a few times as large
/// as the result, is then compressed to the tolerance as build_hierarchical_transfer does.
///
/// `form_factors` are a compressed G = A^1/2 F A^-1/2 in f32 or f16 (compress_form_factors). Their
/// error stays in the result and must be well below the tolerance; the reported error does not
/// contain it. Throws Error if the least memory is above the limit, if F is not a passive exchange
/// (I - R G R not positive definite), or if the checkpoint cannot be written; Cancelled if asked to
/// stop. The bits do not depend on the number of threads, the memory limit or the checkpoint.
std::shared_ptr<const HierarchicalOperator> build_matrix_free_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches,
    const FittingLights& lights, const MatrixFreeTransferSettings& settings,
    const Progress& progress = {});

}  // namespace rebounce

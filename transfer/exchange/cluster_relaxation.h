#pragma once

#include <memory>

#include "transfer/exchange/relaxation.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Gauss-Seidel sweeps over the first matrix of `exchange`, a symmetric matrix G = A^1/2 F A^-1/2
/// in hierarchical form. `exchange` must outlive them. See CompressedFormFactors::make_relaxation.
std::unique_ptr<Relaxation> make_cluster_relaxation(const HierarchicalStorage& exchange);

}  // namespace rebounce

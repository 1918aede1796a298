#pragma once

#include <vector>

#include "dense_kernels.h"

namespace rebounce::bench {

/// The tile kernels that this processor runs, narrowest first.
std::vector<const DenseKernels*> available_kernels();

}  // namespace rebounce::bench

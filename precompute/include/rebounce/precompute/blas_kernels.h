#pragma once

#include <string>
#include <string_view>

namespace rebounce {

/// What a processor can do, as far as kernels of a BLAS need it.
struct ProcessorFeatures {
  bool avx2_and_fma = false;
  bool avx512 = false;  ///< F, DQ, BW and VL
};

ProcessorFeatures processor_features();

/// The name of the kernels (OPENBLAS_CORETYPE) that OpenBLAS should use instead of those named
/// `chosen`, or nothing if these will do. Processors newer than itself it takes for a Prescott of
/// 2004, whose kernels need five times as long, and of which that for symmetric products reads past
/// the end of a vector (0.3.21: a crash, rarely).
std::string better_blas_kernels(std::string_view chosen, const ProcessorFeatures& features);

/// To be called first in a program: starts it again, with the same arguments, where OpenBLAS has
/// not found the kernels of this processor, which it reads from the environment as it is loaded,
/// never later. Does nothing where OPENBLAS_CORETYPE is set already, where there is nothing better,
/// or where the program cannot be started again.
void restart_with_better_blas_kernels(char** arguments);

}  // namespace rebounce

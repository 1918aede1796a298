#pragma once

#include <string>
#include <string_view>

namespace rebounce {

/// Loads the BLAS, if it is not. Products do so themselves; before threads that multiply begin,
/// this is where Error is thrown: where there is no OpenBLAS, or no C library for it.
void load_blas();

/// The name of the kernels (OPENBLAS_CORETYPE) that the BLAS multiplies with. Loads it.
std::string blas_kernels();

/// What a processor can do, as far as kernels of a BLAS need it.
struct ProcessorFeatures {
  bool avx2_and_fma = false;
  bool avx512 = false;  ///< F, DQ, BW and VL
};
ProcessorFeatures processor_features();

/// The name of the kernels that OpenBLAS should use instead of those named `chosen`, its own
/// choice; empty where these will do. It takes processors that are newer than itself for one of
/// 2004 (Prescott), whose kernels are several times slower and read past the end of a vector.
std::string better_blas_kernels(std::string_view chosen, const ProcessorFeatures& features);

}  // namespace rebounce

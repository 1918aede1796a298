#pragma once

#include <string>
#include <string_view>

namespace rebounce {

/// Loads the BLAS unless it is loaded. Products load it too; call this before threads that multiply
/// begin. Throws Error if OpenBLAS, or a C library for it, is not found.
void load_blas();

/// The name of the kernels (OPENBLAS_CORETYPE) that the BLAS multiplies with. Loads the BLAS.
std::string blas_kernels();

/// The instruction sets of a processor that BLAS kernels need.
struct ProcessorFeatures {
  bool avx2_and_fma = false;
  bool avx512 = false;  ///< F, DQ, BW and VL
};
ProcessorFeatures processor_features();

/// The name of the kernels that OpenBLAS should use instead of `chosen`, its own choice; empty
/// where its choice is good. OpenBLAS takes a processor that is newer than itself for one of 2004
/// (Prescott). The kernels of that one are several times slower and read past the end of a vector.
/// Or it takes the processor for one without AVX-512.
std::string better_blas_kernels(std::string_view chosen, const ProcessorFeatures& features);

}  // namespace rebounce

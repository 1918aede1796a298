#pragma once

namespace rebounce::cli {

/// Begins the program anew if OpenBLAS has chosen kernels of 256 bits on a processor with AVX-512,
/// as version 0.3.21 does on those that came after it: with kernels of 512 bits matrices are
/// multiplied in half the time. OpenBLAS chooses once, before main(), and OPENBLAS_CORETYPE in the
/// environment tells it; whoever has set that is left alone. Call first of all in main().
void choose_blas_kernels(char** argv);

}  // namespace rebounce::cli

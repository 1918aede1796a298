#pragma once

namespace rebounce {

/// Floating-point operations a second of the BLAS's products in single precision, all threads
/// together: the best of a few products, which take some hundredths of a second.
double measure_blas_speed();

}  // namespace rebounce

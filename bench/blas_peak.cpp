#include "bench/blas_peak.h"

#include <omp.h>

#include <Eigen/Core>

#include "precompute/base/blas.h"

namespace rebounce::bench {

BlasPeak::BlasPeak() : operands_(static_cast<std::size_t>(omp_get_max_threads())) {
#pragma omp parallel for schedule(static)
  for (Operands& own : operands_) {
    own.a.assign(kSize * kSize, 0.5);
    own.b.assign(kSize * kSize, 0.25);
    own.c.assign(kSize * kSize, 0.0);
  }
}

void BlasPeak::run() {
  load_blas();
  constexpr auto kN = static_cast<int>(kSize);
  constexpr double kOne = 1, kZero = 0;
#pragma omp parallel for schedule(static)
  for (Operands& own : operands_) {
    dgemm_("N", "T", &kN, &kN, &kN, &kOne, own.a.data(), &kN, own.b.data(), &kN, &kZero,
           own.c.data(), &kN);
  }
}

double BlasPeak::flops() const {
  constexpr auto kN = static_cast<double>(kSize);
  return 2 * kN * kN * kN * static_cast<double>(operands_.size());
}

}  // namespace rebounce::bench

#include "blas_peak.h"

#include <cblas.h>
#include <omp.h>

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
  openblas_set_num_threads(1);
  constexpr auto kN = static_cast<blasint>(kSize);
#pragma omp parallel for schedule(static)
  for (Operands& own : operands_) {
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, kN, kN, kN, 1.0, own.a.data(), kN,
                own.b.data(), kN, 0.0, own.c.data(), kN);
  }
}

double BlasPeak::flops() const {
  constexpr auto kN = static_cast<double>(kSize);
  return 2 * kN * kN * kN * static_cast<double>(operands_.size());
}

}  // namespace rebounce::bench

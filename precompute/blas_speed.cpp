#include "blas_speed.h"

#include <omp.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <vector>

#include "single_threaded_blas.h"

namespace rebounce {

double measure_blas_speed() {
  constexpr Eigen::Index kSize = 512;
  constexpr int kTimes = 5;
  using Matrix = Eigen::MatrixXf;
  const SingleThreadedBlas single;
  const Matrix a = Matrix::Constant(kSize, kSize, 0.5F);
  std::vector<Matrix> product(static_cast<std::size_t>(omp_get_max_threads()),
                              Matrix::Zero(kSize, kSize));
  double best = 0;
  for (int k = 0; k < kTimes; ++k) {
    const auto begin = std::chrono::steady_clock::now();
#pragma omp parallel for schedule(static)
    for (Matrix& own : product) own.noalias() = a * a;
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    const auto operations = 2.0 * kSize * kSize * kSize * static_cast<double>(product.size());
    best = std::max(best, operations / seconds.count());
  }
  return best;
}

}  // namespace rebounce

// What tests/precompute/blas_of_python.py loads.
#include <Eigen/Core>

#include "precompute/base/blas.h"

extern "C" {

bool kernels_fit_processor() {
  return rebounce::better_blas_kernels(rebounce::blas_kernels(), rebounce::processor_features())
      .empty();
}

/// The largest error of a product of ones.
float error_of_product() {
  constexpr Eigen::Index kSize = 300;
  const Eigen::MatrixXf ones = Eigen::MatrixXf::Ones(kSize, kSize);
  const Eigen::MatrixXf product = ones * ones;
  return (product.array() - static_cast<float>(kSize)).abs().maxCoeff();
}
}

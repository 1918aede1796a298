#pragma once

#include <Eigen/Core>

#include "rebounce/transfer/dense_operator.h"

namespace rebounce {

/// Yhat x for one of the matrices of a dense operator in f32 and many vectors at once, x [n][k]:
/// each tile is read once for all of them. The same bits for any number of threads.
Eigen::MatrixXf multiply_symmetric(const DenseOperator& dense, std::uint32_t matrix,
                                   const Eigen::MatrixXf& x);

}  // namespace rebounce

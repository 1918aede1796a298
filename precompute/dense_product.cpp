#define EIGEN_USE_BLAS
#define EIGEN_DONT_PARALLELIZE
#include "dense_product.h"

#include <cassert>

#include "single_threaded_blas.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

constexpr Index kTile = DenseOperator::kTile;
using Tile = Eigen::Matrix<float, kTile, kTile, Eigen::RowMajor>;

}  // namespace

MatrixXf multiply_symmetric(const DenseOperator& dense, std::uint32_t matrix, const MatrixXf& x) {
  const DenseOperator::Storage& storage = dense.storage();
  assert(storage.precision == Precision::kF32);
  const SingleThreadedBlas single_threaded;
  const auto n = static_cast<Index>(dense.patch_count());
  const Index side = (n + kTile - 1) / kTile;
  const float* const tiles =
      storage.tiles_f32.data() +
      matrix * DenseOperator::tile_count(dense.patch_count()) * kTile * kTile;
  const auto tile = [&](Index row, Index column) {
    return Eigen::Map<const Tile>(tiles + (row * (row + 1) / 2 + column) * kTile * kTile);
  };
  MatrixXf padded = MatrixXf::Zero(side * kTile, x.cols());
  padded.topRows(n) = x;
  MatrixXf result(side * kTile, x.cols());
#pragma omp parallel for schedule(dynamic, 1)
  for (Index i = 0; i < side; ++i) {
    MatrixXf sum = MatrixXf::Zero(kTile, x.cols());
    for (Index j = 0; j < side; ++j) {
      const auto part = padded.middleRows(j * kTile, kTile);
      if (j <= i) {
        sum.noalias() += tile(i, j) * part;
      } else {
        sum.noalias() += tile(j, i).transpose() * part;
      }
    }
    result.middleRows(i * kTile, kTile) = sum;
  }
  return result.topRows(n);
}

}  // namespace rebounce

#include "precompute/compression/low_rank_transfer.h"

#include <algorithm>
#include <numeric>
#include <random>

#include "precompute/base/blas.h"
#include "precompute/base/eigenvectors.h"
#include "precompute/base/orthonormal_columns.h"
#include "precompute/base/symmetric_matrix.h"
#include "rebounce/error.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

// Up to this number of patches all eigenvectors are found. This takes seconds at most.
constexpr Index kDenseSize = 700;

// The sketch has rank / kSketchPart + kSketchMargin columns beyond the rank. The spectrum
// falls slowly (corners): with fewer columns or fewer multiplications by sum Yhat² the subspace is
// some per cent off the best.
constexpr Index kSketchPart = 2, kSketchMargin = 8;
constexpr int kIterations = 4;

MatrixXf random_start(Index rows, Index columns) {
  std::mt19937 engine(1);
  MatrixXf random(rows, columns);
  for (Index k = 0; k < random.size(); ++k) {
    random.data()[k] = static_cast<float>(engine() * 0x1p-31) - 1.0F;
  }
  return random;
}

/// Turns a subspace towards the leading eigenvectors of sum Yhat².
MatrixXf iterate(const DenseMatrix& dense, const MatrixXf& basis) {
  MatrixXf sum = MatrixXf::Zero(basis.rows(), basis.cols());
  for (std::uint32_t m = 0; m < dense.matrix_count(); ++m) {
    sum += dense.multiply(m, dense.multiply(m, basis));
  }
  return orthonormal_columns(sum);
}

/// Yhat V of each matrix, for the leading eigenvectors V of sum Yhat² within the span of `basis`.
struct RitzVectors {
  MatrixXf basis;
  std::vector<MatrixXf> images;
};

RitzVectors ritz_vectors(const DenseMatrix& dense, const MatrixXf& basis, Index rank) {
  RitzVectors result;
  MatrixXd gram = MatrixXd::Zero(basis.cols(), basis.cols());
  for (std::uint32_t m = 0; m < dense.matrix_count(); ++m) {
    result.images.push_back(dense.multiply(m, basis));
    const MatrixXd image = result.images.back().cast<double>();
    gram += image.transpose() * image;
  }
  const MatrixXf leading =
      eigenvectors(gram).vectors.rightCols(rank).rowwise().reverse().cast<float>();
  result.basis = basis * leading;
  for (MatrixXf& image : result.images) image = image * leading;
  return result;
}

/// One block on the diagonal: its basis [rank][positions] and its coupling matrices, one after the
/// other.
HierarchicalStorage one_block(const DenseOperator::Storage& dense, const RitzVectors& vectors) {
  const std::size_t n = dense.area.size(), positions = HierarchicalFormat::position_count(n);
  const auto size = static_cast<std::uint32_t>(positions);
  const auto rank = static_cast<std::uint32_t>(vectors.basis.cols());
  MatrixXf basis = MatrixXf::Zero(static_cast<Index>(positions), vectors.basis.cols());
  basis.topRows(vectors.basis.rows()) = vectors.basis;
  std::vector<float> values(basis.data(), basis.data() + basis.size());
  for (const MatrixXf& image : vectors.images) {
    const MatrixXf coupling = vectors.basis.transpose() * image;
    const MatrixXf symmetric = 0.5F * (coupling + coupling.transpose());
    values.insert(values.end(), symmetric.data(), symmetric.data() + symmetric.size());
  }
  values.resize(values.size() + HierarchicalFormat::kPadding);
  HierarchicalStorage storage;
  storage.area = dense.area;
  storage.patch.resize(n);
  std::iota(storage.patch.begin(), storage.patch.end(), 0U);
  storage.channel_matrix = dense.channel_matrix;
  storage.matrix_count = dense.matrix_count;
  storage.blocks = {{.row_count = size,
                     .column_count = size,
                     .kind = TransferBlock::Kind::kLowRank,
                     .row_rank = rank,
                     .column_rank = rank}};
  storage.values_f32 = SharedArray(std::move(values));
  return storage;
}

}  // namespace

std::shared_ptr<const HierarchicalOperator> build_low_rank_transfer(const DenseOperator& dense,
                                                                    const LowRankSettings& settings,
                                                                    const Progress& progress) {
  load_blas();
  const DenseMatrix matrix(dense);
  const auto n = static_cast<Index>(matrix.area().size());
  const Index rank = std::min(n, static_cast<Index>(settings.rank));
  report_progress(progress, 0);
  const Index columns = rank + rank / kSketchPart + kSketchMargin;
  MatrixXf basis = MatrixXf::Identity(n, n);
  if (n > kDenseSize && columns < n) {
    basis = orthonormal_columns(random_start(n, columns));
    for (int k = 0; k < kIterations; ++k) {
      basis = iterate(matrix, basis);
      report_progress(progress, (k + 1.0) / (kIterations + 1));
    }
  }
  const RitzVectors vectors = ritz_vectors(matrix, basis, rank);
  report_progress(progress, 1);

  return std::make_shared<const HierarchicalOperator>(
      encode_values(one_block(dense.storage(), vectors), settings.precision));
}

}  // namespace rebounce

#include "precompute/inverse/tiled_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/Dense>

#include "precompute/base/blas.h"
#include "precompute/base/flush_to_zero.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

/// Reports progress over three stages of equal work, each cubic in the step.
class StageProgress {
 public:
  StageProgress(const Progress& progress, std::size_t steps) : progress_(progress), steps_(steps) {}

  void report(int stage, double done_of_stage) const {
    report_progress(progress_, (stage + done_of_stage) / 3);
  }
  double fraction(std::size_t step) const {
    return static_cast<double>(step + 1) / static_cast<double>(steps_);
  }

 private:
  const Progress& progress_;
  std::size_t steps_;
};

/// Runs work(k) for k < count, shared among threads.
template <typename Work>
void for_each_tile(std::size_t count, const Work& work) {
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < count; ++k) {
    const FlushToZero flush;  // of this thread; it takes some cycles, a tile takes a million
    work(k);
  }
}

template <typename Scalar>
void factor(TiledMatrix<Scalar>& m, const StageProgress& progress) {
  for (std::size_t k = 0; k < m.side(); ++k) {
    auto diagonal = m.tile(k, k);
    const Eigen::LLT<typename TiledMatrix<Scalar>::Matrix> llt(diagonal);
    if (llt.info() != Eigen::Success) {
      throw Error("the radiosity system is not positive definite; a reflectance is 1 or more");
    }
    diagonal = llt.matrixL();
    const std::size_t left = m.side() - k - 1;
    for_each_tile(left, [&](std::size_t index) {
      auto a = m.tile(k + 1 + index, k);
      diagonal.template triangularView<Eigen::Lower>()
          .transpose()
          .template solveInPlace<Eigen::OnTheRight>(a);
    });
    // All tiles (i, j) with k < j <= i, as one index, so that threads share them evenly.
    for_each_tile(left * left, [&](std::size_t index) {
      const std::size_t i = k + 1 + index / left, j = k + 1 + index % left;
      if (j > i) return;
      m.tile(i, j).noalias() -= m.tile(i, k) * m.tile(j, k).transpose();
    });
    const double rest = 1 - progress.fraction(k);
    progress.report(0, 1 - rest * rest * rest);
  }
}

template <typename Scalar>
void invert_lower(TiledMatrix<Scalar>& m, const StageProgress& progress) {
  using Matrix = typename TiledMatrix<Scalar>::Matrix;
  for (std::size_t k = 0; k < m.side(); ++k) {
    auto diagonal = m.tile(k, k);
    const auto lower = diagonal.template triangularView<Eigen::Lower>();
    const std::size_t below = m.side() - k - 1;
    for_each_tile(below, [&](std::size_t index) {
      auto a = m.tile(k + 1 + index, k);
      lower.template solveInPlace<Eigen::OnTheRight>(a);
      a = -a;
    });
    for_each_tile(below * k, [&](std::size_t index) {
      const std::size_t i = k + 1 + index / k, j = index % k;
      m.tile(i, j).noalias() += m.tile(i, k) * m.tile(k, j);
    });
    for_each_tile(k, [&](std::size_t j) {
      auto a = m.tile(k, j);
      lower.solveInPlace(a);
    });
    Matrix inverse = Matrix::Identity(m.kTile, m.kTile);
    lower.solveInPlace(inverse);
    diagonal = inverse;
    progress.report(1, progress.fraction(k));
  }
}

/// Replaces L^-1 by L^-T L^-1.
template <typename Scalar>
void multiply_by_transpose(TiledMatrix<Scalar>& m, const StageProgress& progress) {
  for (std::size_t k = 0; k < m.side(); ++k) {
    for_each_tile(k * k, [&](std::size_t index) {
      const std::size_t i = index / k, j = index % k;
      if (j > i) return;
      m.tile(i, j).noalias() += m.tile(k, i).transpose() * m.tile(k, j);
    });
    auto diagonal = m.tile(k, k);
    for_each_tile(k, [&](std::size_t j) {
      auto a = m.tile(k, j);
      a = diagonal.template triangularView<Eigen::Lower>().transpose() * a.eval();
    });
    const typename TiledMatrix<Scalar>::Matrix product = diagonal.transpose() * diagonal;
    diagonal = product;
    const double done = progress.fraction(k);
    progress.report(2, done * done * done);
  }
}

}  // namespace

template <typename Scalar>
TiledMatrix<Scalar>::TiledMatrix(std::size_t size)
    : size_(size), side_((size + kTile - 1) / kTile), values_(bytes(size) / sizeof(Scalar), 0) {
  for (std::size_t i = size; i < side_ * kTile; ++i) at(i, i) = 1;
}

template <typename Scalar>
std::size_t TiledMatrix<Scalar>::bytes(std::size_t size) {
  const std::size_t side = (size + kTile - 1) / kTile;
  return side * (side + 1) / 2 * kTile * kTile * sizeof(Scalar);
}

template <typename Scalar>
void invert_positive_definite(TiledMatrix<Scalar>& matrix, const Progress& progress) {
  load_blas();
  const FlushToZero flush;
  const StageProgress stages(progress, matrix.side());
  factor(matrix, stages);
  invert_lower(matrix, stages);
  multiply_by_transpose(matrix, stages);
}

template class TiledMatrix<double>;
template class TiledMatrix<float>;
template void invert_positive_definite(TiledMatrix<double>& matrix, const Progress& progress);
template void invert_positive_definite(TiledMatrix<float>& matrix, const Progress& progress);

}  // namespace rebounce

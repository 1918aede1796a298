#include "precompute/inverse/patch_groups.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/random_signs.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Vectors = HierarchicalMatrix::Vectors;

// The part of its light that stays in a group at a bounce, at the least. Some 2 % leaves a room by
// a door; within a room, light spreads far faster (lab/175).
constexpr double kStays = 0.85;

// A group of fewer patches does not stay apart.
constexpr std::size_t kFewestPatches = 512;

// Steps of the iteration, and the seed of its first vectors.
constexpr int kSubspaceSteps = 24;
constexpr std::uint64_t kSeed = 0x9E3779B97F4A7C15ULL;

// Vectors that one thread multiplies side by side.
constexpr Index kTogether = 16;

/// G scaled to M = r^-1/2 G r^-1/2, r the row sums of F; its largest eigenvalue is 1.
class ScaledExchange {
 public:
  explicit ScaledExchange(const HierarchicalMatrix& form_factors) : form_factors_(form_factors) {
    const Index n = form_factors.position_count();
    VectorXd root_area = VectorXd::Zero(n);
    const auto patch = form_factors.patch();
    for (std::size_t k = 0; k < patch.size(); ++k) {
      root_area[static_cast<Index>(k)] = std::sqrt(form_factors.area()[patch[k]]);
    }
    scale_ = VectorXd::Ones(n);
    const VectorXd received = times(root_area);
    for (Index k = 0; k < n; ++k) {
      const bool receives = root_area[k] > 0 && received[k] > 0;
      scale_[k] = receives ? std::sqrt(root_area[k] / received[k]) : 0;
    }
  }

  /// M x, both [positions][k].
  MatrixXd times(const MatrixXd& x) const {
    MatrixXd y(x.rows(), x.cols());
    parallel_loop(
        static_cast<std::size_t>((x.cols() + kTogether - 1) / kTogether), [&](std::size_t part) {
          const Index begin = static_cast<Index>(part) * kTogether;
          const Index count = std::min(kTogether, x.cols() - begin);
          HierarchicalMatrix::Workspace workspace;
          const Vectors sent = (scale_.asDiagonal() * x.middleCols(begin, count)).cast<float>();
          Vectors received(sent.rows(), sent.cols());
          form_factors_.multiply(0, sent, received, workspace);
          y.middleCols(begin, count) = scale_.asDiagonal() * received.cast<double>();
        });
    return y;
  }

 private:
  const HierarchicalMatrix& form_factors_;
  VectorXd scale_;
};

void make_orthonormal_columns(MatrixXd& x) {
  const Eigen::HouseholderQR<MatrixXd> qr(x);
  x = qr.householderQ() * MatrixXd::Identity(x.rows(), x.cols());
}

/// The eigenvectors of light that stays, [positions][k].
MatrixXd lasting_light(const HierarchicalMatrix& form_factors) {
  const ScaledExchange exchange(form_factors);
  const auto n = static_cast<Index>(form_factors.patch().size());
  const Index count = std::min(n, static_cast<Index>(kMostPatchGroups));
  MatrixXd x = random_signs(static_cast<std::uint32_t>(form_factors.position_count()),
                            static_cast<std::uint32_t>(count), kSeed)
                   .cast<double>();
  x.bottomRows(x.rows() - n).setZero();
  make_orthonormal_columns(x);
  for (int step = 0; step < kSubspaceSteps; ++step) {
    x = exchange.times(x);
    make_orthonormal_columns(x);
  }
  const MatrixXd projected = x.transpose() * exchange.times(x);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (projected + projected.transpose()));
  const Index lasting = (solver.eigenvalues().array() > kStays).count();
  return x * solver.eigenvectors().rightCols(lasting);
}

/// The group of each position by eigenvectors, [positions]: those of the positions that pivots of
/// the QR decomposition choose are told apart best.
std::vector<std::size_t> groups_in(const MatrixXd& vectors) {
  const Index count = vectors.cols();
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(vectors.transpose());
  MatrixXd chosen(count, count);
  for (Index k = 0; k < count; ++k) {
    chosen.col(k) = vectors.row(qr.colsPermutation().indices()[k]).transpose();
  }
  const Eigen::JacobiSVD<MatrixXd> svd(chosen, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const MatrixXd part = (vectors * (svd.matrixU() * svd.matrixV().transpose())).cwiseAbs();
  std::vector<std::size_t> group;
  for (Index k = 0; k < part.rows(); ++k) {
    Index of_position = 0;
    part.row(k).maxCoeff(&of_position);
    group.push_back(static_cast<std::size_t>(of_position));
  }
  return group;
}

}  // namespace

std::vector<std::uint8_t> group_patches(const HierarchicalMatrix& form_factors) {
  if (form_factors.patch().size() < 2 * kFewestPatches) return {};
  const MatrixXd vectors = lasting_light(form_factors);
  if (vectors.cols() <= 1) return {};
  const std::vector<std::size_t> of_position = groups_in(vectors);
  const auto position = form_factors.position();
  std::vector<std::size_t> size(static_cast<std::size_t>(vectors.cols()), 0);
  for (const std::uint32_t p : position) ++size[of_position[p]];
  // Patches of small groups are of the largest one, whose number is 0.
  std::vector<std::size_t> order(size.size()), number(size.size(), 0);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater<>(), [&](std::size_t g) { return size[g]; });
  std::size_t count = 0;
  for (const std::size_t g : order) {
    if (size[g] >= kFewestPatches) number[g] = count++;
  }
  if (count <= 1) return {};
  std::vector<std::uint8_t> group;
  for (const std::uint32_t p : position) {
    group.push_back(static_cast<std::uint8_t>(number[of_position[p]]));
  }
  return group;
}

}  // namespace rebounce

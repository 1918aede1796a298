#include "precompute/inverse/patch_groups.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "precompute/base/eigenvectors.h"
#include "precompute/base/orthonormal_columns.h"
#include "precompute/base/random_signs.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The part of its light that stays in a group at a bounce, at the least. Some 2 % leaves a room by
// a door; within a room, light spreads far faster (lab/175).
constexpr double kStays = 0.85;

// A group of fewer patches does not stay apart.
constexpr std::size_t kFewestPatches = 512;

// Steps of the iteration, and the seed of its first vectors.
constexpr int kSubspaceSteps = 24;
constexpr std::uint64_t kSeed = 0x9E3779B97F4A7C15ULL;

/// G scaled to M = r^-1/2 G r^-1/2, r the row sums of F; its largest eigenvalue is 1.
class ScaledExchange {
 public:
  explicit ScaledExchange(const SymmetricMatrix& form_factors) : form_factors_(form_factors) {
    const auto n = static_cast<Index>(form_factors.area().size());
    const VectorXd root_area =
        Eigen::Map<const Eigen::VectorXf>(form_factors.area().data(), n).cast<double>().cwiseSqrt();
    scale_ = VectorXd::Ones(n);
    const VectorXd received = times(root_area);
    for (Index k = 0; k < n; ++k) {
      scale_[k] = received[k] > 0 ? std::sqrt(root_area[k] / received[k]) : 0;
    }
  }

  /// M x, both [n][k].
  MatrixXd times(const MatrixXd& x) const {
    const Eigen::MatrixXf sent = (scale_.asDiagonal() * x).cast<float>();
    return scale_.asDiagonal() * form_factors_.multiply(0, sent).cast<double>();
  }

 private:
  const SymmetricMatrix& form_factors_;
  VectorXd scale_;
};

/// The eigenvectors of light that stays, [n][k].
MatrixXd lasting_light(const SymmetricMatrix& form_factors, const Progress& progress) {
  const ScaledExchange exchange(form_factors);
  const std::size_t n = form_factors.area().size();
  MatrixXd x = random_signs(static_cast<std::uint32_t>(n),
                            static_cast<std::uint32_t>(std::min(n, kMostPatchGroups)), kSeed)
                   .cast<double>();
  x = orthonormal_columns_of_tall(x);
  for (int step = 0; step < kSubspaceSteps; ++step) {
    report_progress(progress, step / (kSubspaceSteps + 1.0));
    x = orthonormal_columns_of_tall(exchange.times(x));
  }
  const MatrixXd projected = x.transpose() * exchange.times(x);
  const Eigenvectors found = eigenvectors(0.5 * (projected + projected.transpose()));
  const Index lasting = (found.values.array() > kStays).count();
  return x * found.vectors.rightCols(lasting);
}

/// The group of each patch by eigenvectors, [n]: those of the patches that pivots of the QR
/// decomposition choose are told apart best.
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
    Index best = 0;
    part.row(k).maxCoeff(&best);
    group.push_back(static_cast<std::size_t>(best));
  }
  return group;
}

}  // namespace

std::vector<std::uint8_t> group_patches(const SymmetricMatrix& form_factors,
                                        const Progress& progress) {
  if (form_factors.area().size() < 2 * kFewestPatches) return {};
  const MatrixXd vectors = lasting_light(form_factors, progress);
  if (vectors.cols() <= 1) return {};
  const std::vector<std::size_t> found = groups_in(vectors);
  std::vector<std::size_t> size(static_cast<std::size_t>(vectors.cols()), 0);
  for (const std::size_t g : found) ++size[g];
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
  for (const std::size_t g : found) group.push_back(static_cast<std::uint8_t>(number[g]));
  return group;
}

}  // namespace rebounce

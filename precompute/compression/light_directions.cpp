#include "precompute/compression/light_directions.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "precompute/base/eigenvectors.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

std::vector<Index> ranks_at(std::span<const LightDirections> cells, double worth) {
  std::vector<Index> ranks;
  for (const LightDirections& cell : cells) ranks.push_back(cell.rank(worth));
  return ranks;
}

/// The directions of `light` [patches][samples] by energy, those with the most first:
/// [patches][patches].
MatrixXd directions_of(const MatrixXd& light) {
  if (light.rows() == 0) return {};
  MatrixXd gram = MatrixXd::Zero(light.rows(), light.rows());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(light);
  return eigenvectors(gram).vectors.rowwise().reverse();
}

/// The directions of `light`, after the orthonormal ones of `kept`. They are found in a basis of
/// the complement of `kept`: where some patches have no light, what has no energy across `kept` is
/// more than `kept`.
MatrixXd directions_after(const MatrixXd& kept, const MatrixXd& light) {
  if (kept.cols() == 0) return directions_of(light);
  const Index rows = kept.rows();
  const Eigen::HouseholderQR<MatrixXd> qr(kept);
  const MatrixXd across =
      qr.householderQ() * MatrixXd::Identity(rows, rows).rightCols(rows - kept.cols());
  MatrixXd directions(rows, rows);
  directions << kept, across * directions_of(across.transpose() * light);
  return directions;
}

}  // namespace

Index LightDirections::rank(double worth) const {
  Index best = kept;
  for (Index k = kept + 1; k < missing.size(); ++k) {
    if (missing[k] + worth * static_cast<double>(k) <
        missing[best] + worth * static_cast<double>(best)) {
      best = k;
    }
  }
  return best;
}

LightDirections find_light_directions(const MatrixXf& from, const MatrixXf& judges,
                                      const MatrixXd& kept) {
  LightDirections found;
  found.kept = kept.cols();
  found.vectors = directions_after(kept, from.cast<double>());
  const VectorXd energies =
      (found.vectors.transpose() * judges.cast<double>()).rowwise().squaredNorm() /
      static_cast<double>(judges.cols());
  found.missing.setZero(energies.size() + 1);
  for (Index k = energies.size(); k-- > 0;) found.missing[k] = found.missing[k + 1] + energies[k];
  return found;
}

std::vector<Index> ranks_within(std::span<const LightDirections> cells, double allowed) {
  constexpr int kHalvings = 60;
  double most = 0;
  for (const LightDirections& cell : cells) most = std::max(most, cell.missing[0]);
  std::vector<Index> ranks = ranks_at(cells, 0);
  double low = 0, high = most;
  for (int step = 0; step < kHalvings; ++step) {
    // The worth of a vector spans many orders of magnitude.
    const double middle = low > 0 ? std::sqrt(low * high) : high * 1e-12;
    const std::vector<Index> tried = ranks_at(cells, middle);
    double missing = 0;
    for (std::size_t c = 0; c < cells.size(); ++c) missing += cells[c].missing[tried[c]];
    if (missing <= allowed) {
      ranks = tried;
      low = middle;
    } else if (low == 0) {
      break;
    } else {
      high = middle;
    }
  }
  return ranks;
}

}  // namespace rebounce

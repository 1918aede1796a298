#include "precompute/compression/sampled_bases.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "precompute/base/blas.h"
#include "precompute/base/parallel_loop.h"
#include "precompute/base/random_signs.h"
#include "precompute/base/ranks.h"
#include "precompute/compression/light_weights.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Vectors = SolvedTransfer::Vectors;

// Samples that are drawn together, and of these the ones that one thread solves for.
constexpr Index kSamples = 128, kGroupSamples = 32;

// The number of samples that directions come from, in usual ranks. With three times the rank k, the
// energy that is missed is on average 1 + k / (3 k - k - 1), one and a half times the least (Halko
// et al., theorem 10.5). Energies fall so steeply that this is worth a few vectors in a hundred.
constexpr double kSamplesOfRank = 3;

// The fewest and the most samples for each matrix, with those that judge (lab/132).
constexpr Index kLeastSamples = 512, kMostSamples = 1536;

// The energy that rounding of couplings adds, as a part of what bases miss (lab/156).
constexpr double kRoundedPart = 1.0 / 16;

/// Light of all bounces but the first over each cell under its weight, [patches][samples].
using Samples = std::vector<MatrixXf>;

/// Orthonormal directions of the weighted light over a cell, those with the most energy first.
struct Directions {
  MatrixXd vectors;  ///< one to a column, [patches][patches]
  VectorXd missing;  ///< [k] energy of the whole, without the first k; [directions + 1]

  /// The rank at which the missing energy and `worth` for each vector are together the least.
  Index rank(double worth) const {
    Index best = 0;
    for (Index k = 1; k < missing.size(); ++k) {
      if (missing[k] + worth * static_cast<double>(k) <
          missing[best] + worth * static_cast<double>(best)) {
        best = k;
      }
    }
    return best;
  }
};

std::vector<Index> ranks_at(std::span<const Directions> cells, double worth) {
  std::vector<Index> ranks;
  for (const Directions& cell : cells) ranks.push_back(cell.rank(worth));
  return ranks;
}

/// The smallest ranks with which at most the `allowed` energy is missing, or as little as can be.
std::vector<Index> ranks_within(std::span<const Directions> cells, double allowed) {
  constexpr int kHalvings = 60;
  double most = 0;
  for (const Directions& cell : cells) most = std::max(most, cell.missing[0]);
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

Index sum_of(std::span<const Index> ranks) {
  return std::accumulate(ranks.begin(), ranks.end(), Index{0});
}

/// The mean square of the relative error of light where random light W w misses an energy of 1: the
/// variance of light_weights.cpp, of one light. W W^T stands for the lights of the sample and the
/// background under them, whose indirect light is 1 each.
double error_of_energy(const CompressionFrame& frame) {
  const double sample = (frame.background.cwiseInverse().asDiagonal() * frame.sample).squaredNorm();
  const auto sources = static_cast<double>(
      frame.roles.count(PatchRoles::kSource, static_cast<std::size_t>(frame.sample.rows())));
  return sample / sources / static_cast<double>(frame.sample.cols());
}

/// Draws samples of one matrix over cells.
class BasisSampler {
 public:
  BasisSampler(const SolvedTransfer& solved, const CompressionFrame& frame,
               const std::vector<std::uint32_t>& cells)
      : solved_(solved), frame_(frame), error_of_energy_(error_of_energy(frame)) {
    std::vector<Cluster> clusters;
    for (const std::uint32_t index : cells) clusters.push_back(frame.tree.clusters[index]);
    weights_ = make_cluster_weights(clusters, frame.sample, frame.background, frame.roles);
    const auto position = solved.form_factors().position();
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      Cell& cell = cells_.emplace_back();
      cell.cluster = clusters[c];
      cell.patches = patches_of(frame.tree, cell.cluster);
      const bool sends = std::ranges::any_of(
          cell.patches, [&](std::uint32_t p) { return frame.roles.is_source(p); });
      if (sends) cell.weight = &weights_[c];
      for (const std::uint32_t p : cell.patches) cell.position.push_back(position[p]);
    }
  }

  /// Samples that are those of no other number.
  Samples draw(std::uint32_t matrix, std::uint64_t number) const {
    const Ranks ranks;
    const auto rows = static_cast<Index>(frame_.tree.patch.size());
    MatrixXf light(rows, kSamples);
    parallel_loop(kSamples / kGroupSamples, [&](std::size_t group) {
      if (!ranks.makes(group)) return;
      const Index begin = static_cast<Index>(group) * kGroupSamples;
      draw_group(matrix, number * kSamples + begin, light.middleCols(begin, kGroupSamples));
    });
    ranks.share(std::span(light.data(), static_cast<std::size_t>(light.size())),
                static_cast<std::size_t>(kGroupSamples * rows));
    Samples samples;
    for (const Cell& cell : cells_) {
      samples.emplace_back(light.middleRows(cell.cluster.begin, cell.patch_count()));
    }
    return samples;
  }

  /// The directions of samples `from`, with the energies of other samples.
  std::vector<Directions> find_directions(const Samples& from, const Samples& judges) const {
    std::vector<Directions> cells(from.size());
    parallel_loop(cells.size(), [&](std::size_t c) {
      const MatrixXd light = from[c].cast<double>();
      MatrixXd gram = MatrixXd::Zero(light.rows(), light.rows());
      gram.selfadjointView<Eigen::Lower>().rankUpdate(light);
      const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram);
      cells[c].vectors = solver.eigenvectors().rowwise().reverse();
      const VectorXd energies =
          (cells[c].vectors.transpose() * judges[c].cast<double>()).rowwise().squaredNorm() /
          static_cast<double>(judges[c].cols());
      VectorXd& missing = cells[c].missing;
      missing.setZero(energies.size() + 1);
      for (Index k = energies.size(); k-- > 0;) missing[k] = missing[k + 1] + energies[k];
    });
    return cells;
  }

  /// The mean square of the relative error of arriving light, of what `judges` stand for, with
  /// these ranks.
  double squared_error(std::span<const Directions> cells, std::span<const Index> ranks,
                       const Samples& judges) const {
    std::vector<double> missing(cells.size());
    parallel_loop(cells.size(), [&](std::size_t c) {
      const MatrixXd light = judges[c].cast<double>();
      const auto kept = cells[c].vectors.leftCols(ranks[c]);
      MatrixXd left = MatrixXd::Zero(cells_[c].cluster.count, light.cols());
      left.topRows(light.rows()) = light - kept * (kept.transpose() * light);
      if (cells_[c].weight != nullptr) cells_[c].weight->unweigh_rows(left);
      missing[c] = left.squaredNorm() / static_cast<double>(light.cols());
    });
    return error_of_energy_ * std::accumulate(missing.begin(), missing.end(), 0.0);
  }

  /// The basis of a cell from the first directions of its weighted light.
  SharedBases::Basis basis(std::size_t c, const Directions& directions, Index rank) const {
    const Cell& cell = cells_[c];
    MatrixXd lights = MatrixXd::Zero(cell.cluster.count, rank);
    lights.topRows(cell.patch_count()) = directions.vectors.leftCols(rank);
    MatrixXd vectors = lights;
    if (cell.weight != nullptr) {
      cell.weight->send(lights);
      cell.weight->unweigh_rows(vectors);
    }
    return {lights.topRows(cell.patch_count()).cast<float>(),
            vectors.topRows(cell.patch_count()).cast<float>()};
  }

  std::vector<std::vector<std::uint32_t>> patches() const {
    std::vector<std::vector<std::uint32_t>> lists;
    for (const Cell& cell : cells_) lists.emplace_back(cell.patches.begin(), cell.patches.end());
    return lists;
  }

 private:
  struct Cell {
    Cluster cluster;
    std::span<const std::uint32_t> patches;
    std::vector<std::uint32_t> position;    ///< of each patch, in the form factors
    const ClusterWeight* weight = nullptr;  ///< null for a cell without sources
    Index patch_count() const { return static_cast<Index>(patches.size()); }
  };

  bool has_role(std::uint32_t patch) const { return frame_.roles.has(patch, PatchRoles::kBoth); }

  /// Random light of a cell, as strong as its weight, [positions of the cluster][k].
  MatrixXd random_light(const Cell& cell, std::uint64_t seed) const {
    MatrixXd light =
        random_signs(cell.cluster.count, kGroupSamples, seed + cell.cluster.begin).cast<double>();
    for (Index k = 0; k < cell.patch_count(); ++k) {
      if (!has_role(cell.patches[k])) light.row(k).setZero();
    }
    light.bottomRows(cell.cluster.count - cell.patch_count()).setZero();
    if (cell.weight != nullptr) cell.weight->send(light);
    return light;
  }

  /// Light over a cell under its weight, [patches][k].
  MatrixXd weighted(const Cell& cell, const Vectors& light) const {
    MatrixXd part = MatrixXd::Zero(cell.cluster.count, light.cols());
    for (Index k = 0; k < cell.patch_count(); ++k) {
      if (has_role(cell.patches[k])) part.row(k) = light.row(cell.position[k]).cast<double>();
    }
    if (cell.weight != nullptr) cell.weight->weigh_rows(part);
    return part.topRows(cell.patch_count());
  }

  void draw_group(std::uint32_t matrix, std::uint64_t seed, Eigen::Ref<MatrixXf> light) const {
    SolvedTransfer::Workspace workspace;
    Vectors sent = Vectors::Zero(solved_.position_count(), kGroupSamples);
    for (const Cell& cell : cells_) {
      const MatrixXd random = random_light(cell, seed << 32);
      for (Index k = 0; k < cell.patch_count(); ++k) {
        sent.row(cell.position[k]) = random.row(k).cast<float>();
      }
    }
    const Vectors& later = solved_.later_bounces(matrix, sent, workspace);
    for (const Cell& cell : cells_) {
      light.middleRows(cell.cluster.begin, cell.patch_count()) =
          weighted(cell, later).cast<float>();
    }
  }

  const SolvedTransfer& solved_;
  const CompressionFrame& frame_;
  double error_of_energy_;
  std::vector<ClusterWeight> weights_;  ///< of the cells
  std::vector<Cell> cells_;
};

void append(Samples& light, const Samples& more) {
  if (light.empty()) light.resize(more.size());
  for (std::size_t c = 0; c < light.size(); ++c) {
    const Index before = light[c].cols();
    light[c].conservativeResize(more[c].rows(), before + more[c].cols());
    light[c].rightCols(more[c].cols()) = more[c];
  }
}

/// The smallest ranks with a mean square error of about `allowed`, as judges tell it.
std::vector<Index> find_ranks(const BasisSampler& sampler, std::span<const Directions> cells,
                              const Samples& judges, double allowed) {
  // The weights of the cells are known, and what their missing energy means for light follows from
  // it nearly in proportion.
  constexpr int kSteps = 4;
  double energy = 0;
  for (const Directions& cell : cells) energy += cell.missing[0];
  std::vector<Index> ranks(cells.size());
  double error = sampler.squared_error(cells, ranks, judges);
  for (int step = 0; step < kSteps && error > 0; ++step) {
    energy *= allowed / error;
    ranks = ranks_within(cells, energy);
    error = sampler.squared_error(cells, ranks, judges);
  }
  return ranks;
}

/// The step of couplings that rounding adds a part of the missing energy with. Bases are
/// orthonormal under their weights, so that the errors of the couplings have the energy of those of
/// the light; an error of rounding has a twelfth of the square of the step.
double step_of(std::span<const Directions> cells, std::span<const Index> ranks) {
  double missing = 0;
  for (std::size_t c = 0; c < cells.size(); ++c) missing += cells[c].missing[ranks[c]];
  const auto vectors = static_cast<double>(std::max<Index>(1, sum_of(ranks)));
  return std::sqrt(12 * kRoundedPart * missing) / vectors;
}

/// Appends the bases of one matrix.
void sample_matrix(const BasisSampler& sampler, std::uint32_t matrix, double allowed,
                   SharedBases& result, const Progress& progress) {
  std::uint64_t number = 0;
  const auto draw = [&] {
    report_progress(progress, std::min(1.0, static_cast<double>(number * kSamples) / kMostSamples));
    return sampler.draw(matrix, number++);
  };
  Samples light;
  double enough = kLeastSamples - kSamples;
  const auto are_enough = [&] {
    const Index count = light.empty() ? 0 : light.front().cols();
    return static_cast<double>(count) >= enough || count >= kMostSamples;
  };
  for (;;) {
    while (!are_enough()) append(light, draw());
    const Samples judges = draw();
    const std::vector<Directions> directions = sampler.find_directions(light, judges);
    const std::vector<Index> ranks = find_ranks(sampler, directions, judges, allowed);
    enough =
        kSamplesOfRank * static_cast<double>(sum_of(ranks)) / static_cast<double>(ranks.size());
    if (!are_enough()) {
      append(light, judges);
      continue;
    }
    result.step.push_back(step_of(directions, ranks));
    std::vector<SharedBases::Basis>& bases = result.bases.emplace_back();
    for (std::size_t c = 0; c < ranks.size(); ++c) {
      bases.push_back(sampler.basis(c, directions[c], ranks[c]));
    }
    result.sample_count += number * static_cast<std::size_t>(kSamples);
    return;
  }
}

}  // namespace

SharedBases sample_bases(const SolvedTransfer& solved, const CompressionFrame& frame,
                         const std::vector<std::uint32_t>& cells, double tolerance,
                         const Progress& progress) {
  load_blas();
  const BasisSampler sampler(solved, frame, cells);
  SharedBases result{.patches = sampler.patches(), .bases = {}, .step = {}};
  const double count = solved.matrix_count();
  // Errors count on both sides, and in every channel.
  const double allowed = tolerance * tolerance / 2 / kChannelCount;
  for (std::uint32_t m = 0; m < solved.matrix_count(); ++m) {
    sample_matrix(sampler, m, allowed, result, part_of(progress, m / count, (m + 1) / count));
  }
  return result;
}

}  // namespace rebounce

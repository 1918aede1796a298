#include "precompute/compression/sampled_bases.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "precompute/base/blas.h"
#include "precompute/base/parallel_loop.h"
#include "precompute/base/random_signs.h"
#include "precompute/base/ranks.h"
#include "precompute/base/scratch_pool.h"
#include "precompute/compression/light_directions.h"
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

// The fewest and the most samples for each matrix, with those that judge (lab/132). Of far
// directions there are fewer.
constexpr Index kLeastSamples = 512, kLeastFarSamples = 256, kMostSamples = 1536;

// The part of the allowed error that is left to light between groups of cells (lab/178).
constexpr double kFarPart = 0.25;

// The energy that rounding of couplings adds, as a part of what bases miss (lab/156).
constexpr double kRoundedPart = 1.0 / 16;

/// Light of all bounces but the first over each cell under its weight, [patches][samples].
using Samples = std::vector<MatrixXf>;

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

/// The directions of the light over the cells, and how many of them a basis takes.
struct ChosenDirections {
  std::vector<LightDirections> cells;
  std::vector<Index> ranks;
  double squared_error = 0;  ///< of light with these ranks
};

/// The directions of samples `from` of each cell, after those that are `kept`.
std::vector<LightDirections> find_directions(const Samples& from, const Samples& judges,
                                             std::span<const MatrixXd> kept) {
  std::vector<LightDirections> cells(from.size());
  parallel_loop(cells.size(), [&](std::size_t c) {
    cells[c] = find_light_directions(from[c], judges[c], kept[c]);
  });
  return cells;
}

/// The group of most of `patches`.
std::uint32_t usual_group(const CompressionFrame& frame, std::span<const std::uint32_t> patches) {
  if (frame.group.empty()) return 0;
  std::array<std::size_t, kMostPatchGroups> count{};
  for (const std::uint32_t p : patches) ++count[frame.group[p]];
  return static_cast<std::uint32_t>(std::ranges::max_element(count) - count.begin());
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
    for (const Cell& cell : cells_) group_.push_back(usual_group(frame, cell.patches));
  }

  /// The group of each cell.
  const std::vector<std::uint32_t>& group() const { return group_; }

  /// Samples that are those of no other number. Sources of a cell send those samples k, counted
  /// over all numbers, for which `is_lit`(cell, k).
  template <typename IsLit>
  Samples draw(std::uint32_t matrix, std::uint64_t number, const IsLit& is_lit) const {
    const Ranks ranks;
    const auto rows = static_cast<Index>(frame_.tree.patch.size());
    MatrixXf light(rows, kSamples);
    parallel_loop(
        kSamples / kGroupSamples, 1, [&] { return workspaces_.lend(); },
        [&](std::size_t group, const auto& workspace) {
          if (!ranks.makes(group)) return;
          const Index begin = static_cast<Index>(group) * kGroupSamples;
          draw_group(matrix, number * kSamples + begin, is_lit, *workspace,
                     light.middleCols(begin, kGroupSamples));
        });
    ranks.share(std::span(light.data(), static_cast<std::size_t>(light.size())),
                static_cast<std::size_t>(kGroupSamples * rows));
    Samples samples;
    for (const Cell& cell : cells_) {
      samples.emplace_back(light.middleRows(cell.cluster.begin, cell.patch_count()));
    }
    return samples;
  }

  /// The mean square of the relative error of arriving light, of what `judges` stand for, with
  /// these ranks.
  double squared_error(std::span<const LightDirections> cells, std::span<const Index> ranks,
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

  /// The basis of a cell from the first directions of its weighted light. Those that are kept are
  /// far ones.
  SharedBases::Basis basis(std::size_t c, const LightDirections& directions, Index rank) const {
    const Cell& cell = cells_[c];
    MatrixXd lights = MatrixXd::Zero(cell.cluster.count, rank);
    lights.topRows(cell.patch_count()) = directions.vectors.leftCols(rank);
    MatrixXd vectors = lights;
    if (cell.weight != nullptr) {
      cell.weight->send(lights);
      cell.weight->unweigh_rows(vectors);
    }
    return {lights.topRows(cell.patch_count()).cast<float>(),
            vectors.topRows(cell.patch_count()).cast<float>(), directions.kept};
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

  /// The samples from number `first` on.
  template <typename IsLit>
  void draw_group(std::uint32_t matrix, std::uint64_t first, const IsLit& is_lit,
                  SolvedTransfer::Workspace& workspace, Eigen::Ref<MatrixXf> light) const {
    Vectors sent = Vectors::Zero(solved_.position_count(), kGroupSamples);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      const Cell& cell = cells_[c];
      MatrixXd random = random_light(cell, first << 32);
      for (Index k = 0; k < kGroupSamples; ++k) {
        if (!is_lit(c, first + static_cast<std::uint64_t>(k))) random.col(k).setZero();
      }
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
  std::vector<std::uint32_t> group_;  ///< of each cell
  mutable ScratchPool<SolvedTransfer::Workspace> workspaces_;
};

void append(MatrixXf& light, const MatrixXf& more) {
  const Index before = light.cols();
  light.conservativeResize(more.rows(), before + more.cols());
  light.rightCols(more.cols()) = more;
}

void append(Samples& light, const Samples& more) {
  if (light.empty()) light.resize(more.size());
  for (std::size_t c = 0; c < light.size(); ++c) append(light[c], more[c]);
}

/// The smallest ranks with a mean square error of about `allowed`, as judges tell it, and what they
/// err by.
void choose_ranks(const BasisSampler& sampler, const Samples& judges, double allowed,
                  ChosenDirections& chosen) {
  // The weights of the cells are known, and what their missing energy means for light follows from
  // it nearly in proportion.
  constexpr int kSteps = 4, kMostSteps = 12;
  constexpr double kMostOver = 1.2;
  const auto is_over = [&] { return chosen.squared_error > kMostOver * allowed; };
  double energy = 0;
  std::vector<Index> kept;
  for (const LightDirections& cell : chosen.cells) {
    energy += cell.missing[cell.kept];
    kept.push_back(cell.kept);
  }
  const auto take = [&](std::vector<Index> ranks) {
    chosen.squared_error = sampler.squared_error(chosen.cells, ranks, judges);
    chosen.ranks = std::move(ranks);
  };
  take(std::move(kept));
  std::vector<Index> within;
  for (int step = 0; step < (is_over() ? kMostSteps : kSteps); ++step) {
    if (chosen.squared_error == 0) break;
    energy *= allowed / chosen.squared_error;
    take(ranks_within(chosen.cells, energy));
    if (chosen.squared_error <= allowed) within = chosen.ranks;
  }
  // Where a few directions have nearly all the energy, the error jumps.
  if (is_over()) {
    take(within.empty() ? ranks_within(chosen.cells, 0) : std::move(within));
  }
}

/// Finds directions of samples that `draw`() gives, with which light errs by `allowed`, after those
/// that are `kept`. More are drawn until they are several times the usual rank.
template <typename Draw>
ChosenDirections choose_directions(const BasisSampler& sampler, std::span<const MatrixXd> kept,
                                   double allowed, Index least_samples, const Draw& draw) {
  ChosenDirections chosen;
  Samples light;
  auto enough = static_cast<double>(least_samples - kSamples);
  const auto are_enough = [&] {
    const Index count = light.empty() ? 0 : light.front().cols();
    return static_cast<double>(count) >= enough || count >= kMostSamples;
  };
  for (;;) {
    while (!are_enough()) append(light, draw());
    const Samples judges = draw();
    chosen.cells = find_directions(light, judges, kept);
    choose_ranks(sampler, judges, allowed, chosen);
    enough = kSamplesOfRank * static_cast<double>(sum_of(chosen.ranks)) /
             static_cast<double>(chosen.ranks.size());
    if (are_enough()) return chosen;
    append(light, judges);
  }
}

/// The number of couplings of all cells with each other.
double couplings_of(std::span<const std::uint32_t> group, std::span<const LightDirections> cells,
                    std::span<const Index> ranks) {
  std::vector<double> all(group.size(), 0), far(group.size(), 0);  // of each group
  for (std::size_t c = 0; c < group.size(); ++c) {
    all[group[c]] += static_cast<double>(ranks[c]);
    far[group[c]] += static_cast<double>(cells[c].kept);
  }
  const double every_far = std::accumulate(far.begin(), far.end(), 0.0);
  double count = every_far * every_far;
  for (std::size_t g = 0; g < group.size(); ++g) count += all[g] * all[g] - far[g] * far[g];
  return count;
}

/// The step of couplings that rounding adds a part of the missing energy with. Bases are
/// orthonormal under their weights, so that the errors of the couplings have the energy of those of
/// the light; an error of rounding has a twelfth of the square of the step.
double step_of(std::span<const std::uint32_t> group, const ChosenDirections& chosen) {
  double missing = 0;
  for (std::size_t c = 0; c < group.size(); ++c) {
    missing += chosen.cells[c].missing[chosen.ranks[c]];
  }
  const double couplings = couplings_of(group, chosen.cells, chosen.ranks);
  return std::sqrt(12 * kRoundedPart * missing) / std::sqrt(std::max(1.0, couplings));
}

/// Samples of one matrix of the light that comes to cells from other groups. Two samples follow
/// each other that have sources in half of the groups and in the other half; a cell takes the one
/// whose sources are in other groups than its own.
///
/// Which groups are lit is a row of a Hadamard matrix: the parity of the binary digits that the
/// numbers of the row and of the group share. Over all rows but that without digits, any two groups
/// are in different halves equally often.
class FarSampler {
 public:
  FarSampler(const BasisSampler& sampler, std::uint32_t matrix)
      : sampler_(sampler),
        matrix_(matrix),
        rows_(std::bit_ceil(std::ranges::max(sampler.group()) + 1) - 1) {}

  /// The part of the samples in which a group is lit for another one; 0 if there is one group.
  double lit_part() const { return rows_ == 0 ? 0 : (rows_ + 1) / (2.0 * rows_); }
  std::size_t sample_count() const { return (number_ - kFirst) * kSamples; }

  /// kSamples more for each cell.
  Samples draw() {
    Samples light;
    for (int half = 0; half < 2; ++half) append(light, draw_half());
    return light;
  }

 private:
  static constexpr std::uint64_t kFirst = 1 << 16;  // behind the numbers of other samples

  bool is_lit(std::size_t cell, std::uint64_t sample) const {
    const std::uint64_t row = 1 + sample / 2 % rows_;
    return std::popcount(row & sampler_.group()[cell]) % 2 == static_cast<int>(sample % 2);
  }

  Samples draw_half() {
    const Samples all = sampler_.draw(matrix_, number_,
                                      [&](std::size_t c, std::uint64_t k) { return is_lit(c, k); });
    Samples light;
    for (std::size_t c = 0; c < all.size(); ++c) {
      MatrixXf& from_others = light.emplace_back(all[c].rows(), kSamples / 2);
      for (Index pair = 0; pair < from_others.cols(); ++pair) {
        const auto first = static_cast<std::uint64_t>(2 * pair) + number_ * kSamples;
        from_others.col(pair) = all[c].col(2 * pair + (is_lit(c, first) ? 1 : 0));
      }
    }
    ++number_;
    return light;
  }

  const BasisSampler& sampler_;
  std::uint32_t matrix_, rows_;
  std::uint64_t number_ = kFirst;
};

/// The directions in which light goes to and from other groups, [cells].
struct FarDirections {
  std::vector<MatrixXd> vectors;
  double squared_error = 0;  ///< of light without what they leave
  std::size_t sample_count = 0;
};

FarDirections find_far(const BasisSampler& sampler, std::uint32_t matrix, double allowed,
                       const Progress& progress) {
  std::vector<MatrixXd> none;
  for (const auto& patches : sampler.patches()) {
    none.emplace_back(static_cast<Index>(patches.size()), 0);
  }
  FarSampler far(sampler, matrix);
  if (far.lit_part() == 0) return {std::move(none)};
  double drawn = 0;
  const auto draw = [&] {
    report_progress(progress, std::min(1.0, drawn++ * kSamples / kMostSamples));
    return far.draw();
  };
  const ChosenDirections chosen =
      choose_directions(sampler, none, allowed * far.lit_part(), kLeastFarSamples, draw);
  FarDirections found{{}, chosen.squared_error / far.lit_part(), far.sample_count()};
  for (std::size_t c = 0; c < chosen.cells.size(); ++c) {
    found.vectors.emplace_back(chosen.cells[c].vectors.leftCols(chosen.ranks[c]));
  }
  return found;
}

/// Appends the bases of one matrix.
void sample_matrix(const BasisSampler& sampler, std::uint32_t matrix, double allowed,
                   SharedBases& result, const Progress& progress) {
  const FarDirections far =
      find_far(sampler, matrix, kFarPart * allowed, part_of(progress, 0, 0.5));
  const Progress rest = part_of(progress, far.sample_count > 0 ? 0.5 : 0, 1);
  std::uint64_t number = 0;
  const auto draw = [&] {
    report_progress(rest, std::min(1.0, static_cast<double>(number * kSamples) / kMostSamples));
    return sampler.draw(matrix, number++, [](std::size_t, std::uint64_t) { return true; });
  };
  const ChosenDirections chosen =
      choose_directions(sampler, far.vectors, allowed - far.squared_error, kLeastSamples, draw);
  result.step.push_back(step_of(sampler.group(), chosen));
  std::vector<SharedBases::Basis>& bases = result.bases.emplace_back();
  for (std::size_t c = 0; c < chosen.ranks.size(); ++c) {
    bases.push_back(sampler.basis(c, chosen.cells[c], chosen.ranks[c]));
  }
  result.sample_count += number * static_cast<std::size_t>(kSamples) + far.sample_count;
}

}  // namespace

SharedBases sample_bases(const SolvedTransfer& solved, const CompressionFrame& frame,
                         const std::vector<std::uint32_t>& cells, double tolerance,
                         const Progress& progress) {
  load_blas();
  const BasisSampler sampler(solved, frame, cells);
  SharedBases result{
      .patches = sampler.patches(), .bases = {}, .group = sampler.group(), .step = {}};
  const double count = solved.matrix_count();
  // Errors count on both sides, and in every channel.
  const double allowed = tolerance * tolerance / 2 / kChannelCount;
  for (std::uint32_t m = 0; m < solved.matrix_count(); ++m) {
    sample_matrix(sampler, m, allowed, result, part_of(progress, m / count, (m + 1) / count));
  }
  return result;
}

}  // namespace rebounce

#include "precompute/compression/tolerance_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "precompute/base/process_memory.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/compression/multiplier_search.h"
#include "precompute/lights/reference_lighting.h"
#include "precompute/lights/validation_error.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce {
namespace {

// The search for the multiplier aims at kAim of the tolerance and accepts at most kMost of it,
// because other lights than the validation lights may have slightly larger errors (lab/044).
constexpr int kMostRounds = 8;
constexpr double kAim = 0.76, kMost = 0.8;

// The usual number of rounds of the search.
constexpr int kUsualRounds = 3;  // lab/181

// The multiplier at which the search begins, in units of the squared tolerance over the number of
// patches (lab/037).
constexpr double kInitialMultiplier = 2.5;

// Operators with cluster bases mostly end far above that. Above kStartPatches patches, their search
// begins higher by this power of the ratio of patch counts, up to a limit (lab/037, lab/181).
constexpr double kStartPatches = 1000, kStartGrowth = 1.5, kHighestStart = 13;

// Operators without cluster bases, form factors, usually end at 2.5 to 22 times it (lab/037).
constexpr double kPlainStart = 2;

// How errors grow with the multiplier (lab/181), and the least fraction of the size that a further
// round is expected to save (lab/037). A round of form factors takes as long as a tenth of the
// solves that they are made for (lab/180).
constexpr MultiplierSearch::Expected kExpected{.slope = 0.35, .least_saving = 0.03},
    kPlainExpected{.slope = 0.5, .least_saving = 0.08};

// The time of a vector and of a block in a product, beside their values, in units of a value. It
// counts in full in operators of kSizedPatches patches and in part in smaller ones: coefficients
// that the nearest caches do not hold, and the start of loops (lab/036).
constexpr double kVectorSize = 9, kBlockSize = 96, kSizedPatches = 16384;

// The most validation lights that become training lights too.
constexpr std::size_t kMostJoined = 64;

using Lights = std::vector<std::vector<Float3>>;

/// The truth of a uniform light stands in for validation lights from which nothing arrives.
ReferenceLighting validation_truth(const SymmetricMatrix& matrix, Lights lights) {
  ReferenceLighting truth(matrix, std::move(lights));
  if (truth.light_count() > 0) return truth;
  return ReferenceLighting(matrix, Lights(1, {matrix.area().size(), Float3{1, 1, 1}}));
}

/// The progress of a search after a number of rounds: the usual rounds take equal shares, and each
/// further round half of the rest.
double part_of_search(int rounds) {
  constexpr double kEach = 1.0 / kUsualRounds;
  return rounds < kUsualRounds ? rounds * kEach : 1 - std::ldexp(kEach, kUsualRounds - 1 - rounds);
}

/// The sizes of the parts of an operator. A value of a basis in 8 bits, with its share of
/// residuals, takes about half of a value of a coupling matrix in half precision (lab/042). The
/// time of a product counts for operators with cluster bases.
PartSizes part_sizes(const HierarchicalSettings& settings, std::size_t patch_count) {
  PartSizes sizes;
  sizes.basis_value =
      hierarchical_precision(settings.precision).bases == BasisPrecision::kQ8 ? 0.55 : 1;
  if (settings.cluster_bases) {
    const double part = std::min(1.0, static_cast<double>(patch_count) / kSizedPatches);
    sizes.vector += kVectorSize * part;
    sizes.block += kBlockSize * part;
  }
  return sizes;
}

/// Bases in integers have one step for all patches of a cluster, so they need equilibration. Sweeps
/// read the light at positions and do not support cluster bases.
CompressionOptions options_of(const HierarchicalSettings& settings) {
  return {.equilibrated = are_integers(hierarchical_precision(settings.precision).bases) ||
                          settings.cluster_bases,
          .nested = settings.cluster_bases};
}

/// The best operator of the search: the smallest within the limit or, if none is, the most exact.
class Best {
 public:
  explicit Best(double limit) : limit_(limit) {}

  void offer(std::shared_ptr<const HierarchicalOperator> candidate, double error) {
    const bool within = error <= limit_, best_within = best_ && error_ <= limit_;
    const bool better = within && best_within ? candidate->bytes() < best_->bytes()
                                              : within || (!best_within && error < error_);
    if (best_ && !better) return;
    best_ = std::move(candidate);
    error_ = error;
  }

  std::shared_ptr<const HierarchicalOperator> take() { return std::move(best_); }

 private:
  double limit_, error_ = 0;
  std::shared_ptr<const HierarchicalOperator> best_;
};

/// The validation lights that an operator errs too much under become training lights as well, each
/// once, so that the weights know of them: a lamp of a rare kind, that lights one patch alone or
/// burns in a closet, costs little there, and much if the whole operator has to be finer for it.
class WorstLights {
 public:
  explicit WorstLights(double limit) : limit_(limit) {}

  void join(const ReferenceLighting& validation, std::span<const double> errors,
            MatrixCompression& compression) {
    joined_.resize(errors.size());
    std::vector<std::size_t> joining;
    for (std::size_t k = 0; k < errors.size(); ++k) {
      if (errors[k] > limit_ && !joined_[k]) joining.push_back(k);
    }
    if (joining.size() > kMostJoined - count_) {  // the worst of them
      std::ranges::stable_sort(joining, std::greater<>(), [&](std::size_t k) { return errors[k]; });
      joining.resize(kMostJoined - count_);
      std::ranges::sort(joining);
    }
    for (const std::size_t k : joining) {
      compression.add_training_light(validation, k);
      joined_[k] = true;
    }
    count_ += joining.size();
  }

 private:
  double limit_;
  std::vector<bool> joined_;
  std::size_t count_ = 0;
};

/// The multiplier at which a search begins.
double search_start(const HierarchicalSettings& settings, std::size_t patch_count) {
  const double usual = initial_multiplier(settings.tolerance, patch_count);
  if (!settings.cluster_bases) return kPlainStart * usual;
  const double times = static_cast<double>(patch_count) / kStartPatches;
  return usual * std::clamp(std::pow(times, kStartGrowth), 1.0, kHighestStart);
}

}  // namespace

double initial_multiplier(double tolerance, std::size_t patch_count) {
  return kInitialMultiplier * tolerance * tolerance / static_cast<double>(patch_count);
}

std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches, FittingLights lights,
    const HierarchicalSettings& settings, const Progress& progress,
    const BlockCheckpoint& checkpoint) {
  const ReferenceLighting validation = validation_truth(matrix, std::move(lights.validation));
  report_progress(progress, 0);
  MatrixCompression compression(matrix, patches, std::move(lights.training),
                                part_sizes(settings, patches.size()), options_of(settings));
  report_progress(progress, 0);
  const double tolerance = settings.tolerance;
  MultiplierSearch search(compression.multiplier_for(search_start(settings, patches.size())),
                          {kAim * tolerance, kMost * tolerance},
                          settings.cluster_bases ? kExpected : kPlainExpected);
  Best best(kMost * tolerance);
  WorstLights worst(kMost * settings.largest_over_mean * tolerance);
  for (int round = 0; round < kMostRounds && !search.done(); ++round) {
    const Progress part = part_of(progress, part_of_search(round), part_of_search(round + 1));
    const KeptParts kept{checkpoint, fmt::format("round_{}", round)};
    return_freed_memory();  // of lights that are kept otherwise now, and of the round before
    const auto candidate = std::make_shared<const HierarchicalOperator>(
        encode_values(compression.at(search.multiplier(), kept, part), settings.precision));
    const std::vector<double> errors = validation.errors(*candidate);
    const double error = validation_error(errors, settings.largest_over_mean);
    best.offer(candidate, error);
    search.report(error, static_cast<double>(candidate->bytes()));
    if (search.done()) break;
    worst.join(validation, errors, compression);
    // To emphasise again raises the mean error, so that the search may not end (lab/183).
    if (round == 0) compression.emphasise(*candidate);
  }
  return best.take();
}

}  // namespace rebounce

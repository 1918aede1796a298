#include "precompute/compression/matrix_compression.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "precompute/compression/block_tree.h"
#include "precompute/compression/equilibrated_matrix.h"
#include "precompute/compression/multiplier_search.h"
#include "precompute/compression/nested_bases.h"
#include "precompute/compression/wanted_blocks.h"
#include "precompute/lights/reference_lighting.h"
#include "precompute/lights/validation_error.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {
namespace {

// Measured: notes/operator.md.
constexpr std::uint32_t kLeafSize = 32;

// The search for the multiplier aims at this part of the tolerance, and ends at kMost at most:
// other lights than those that it sees may do a little worse.
constexpr int kMostRounds = 8;
constexpr double kAim = 0.76, kMost = 0.8;

// Rounds that the search takes as a rule.
constexpr int kUsualRounds = 4;

// Pieces of a round that are kept in one file: some seconds of work where pieces are largest, and
// enough for many threads to share.
constexpr std::size_t kKeptPieces = 64;

// What one value per patch is worth at the tolerance, to begin the search with: measured over
// scenes and sizes, notes/operator.md.
constexpr double kInitialMultiplier = 2.5;

// Operators with cluster coefficients mostly end far above it. Their search begins higher by this
// power of how many times so many patches they have, and by so much at most. Measured:
// notes/operator.md.
constexpr double kStartPatches = 1000, kStartGrowth = 1.5, kHighestStart = 8;

// Those without, form factors, end at 2.5 to 22 times it as a rule.
constexpr double kPlainStart = 2;

// From one round to the next, the strength of a training light changes by a factor between these.
constexpr double kLeastEmphasis = 0.5, kMostEmphasis = 4;

// The uniform light's part of the energy of all training lights: what makes black surfaces, which
// reflect no light, good enough as lamps.
constexpr double kUniformShare = 0.1;

// What a vector and a block take of an apply beside their values, in values, in operators of so
// many patches, and in part in smaller ones: coefficients that the nearest caches do not hold, and
// loops that begin. Measured: notes/operator.md.
constexpr double kVectorSize = 9, kBlockSize = 96, kSizedPatches = 16384;

using Exitances = std::span<const std::vector<Float3>>;

/// The lights after one with which every patch gives off the same, black ones too.
std::vector<std::vector<Float3>> with_uniform(std::size_t patch_count, Exitances lights) {
  std::vector<std::vector<Float3>> all(1, std::vector<Float3>(patch_count, Float3{1, 1, 1}));
  all.insert(all.end(), lights.begin(), lights.end());
  return all;
}

ReferenceLighting validation_truth(const SymmetricMatrix& matrix, Exitances lights) {
  ReferenceLighting truth(matrix, lights);
  return truth.light_count() > 0
             ? truth
             : ReferenceLighting(matrix, with_uniform(matrix.area().size(), {}));
}

double mean(const std::vector<double>& errors) {
  return std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
}

CompressionFrame frame_of(const SymmetricMatrix& matrix, const PatchTable& patches,
                          const ReferenceLighting& training) {
  constexpr auto kAlignment = static_cast<std::uint32_t>(HierarchicalFormat::kAlignment);
  CompressionFrame frame;
  frame.roles = matrix.roles();
  frame.received_part = training.received().part();
  frame.tree = build_cluster_tree(patches, kLeafSize, kAlignment, role_groups(frame.roles));
  frame.background = background_light(matrix, frame.tree);
  frame.sample = training.normalised_lights(frame.tree.patch,
                                            HierarchicalFormat::position_count(patches.size()));
  frame.sample.col(0) *= std::sqrt(kUniformShare * static_cast<double>(frame.sample.cols()));
  return frame;
}

/// The part of the whole search that some rounds are: all alike as far as usual, and each beyond
/// that half of what is left.
double part_of_search(int rounds) {
  constexpr double kEach = 1.0 / kUsualRounds;
  return rounds < kUsualRounds ? rounds * kEach : 1 - std::ldexp(kEach, kUsualRounds - 1 - rounds);
}

/// Where what is done of a compression is kept, and under which names.
struct KeptParts {
  const BlockCheckpoint& checkpoint;
  std::string prefix;
};

/// What parts of an operator take. In bytes, with the residuals of some, a value of a basis is
/// beside halves. One with cluster coefficients is for applies, whose time counts too.
PartSizes part_sizes(const HierarchicalSettings& settings, std::size_t patch_count) {
  PartSizes sizes;
  sizes.basis_value =
      hierarchical_precision(settings.precision).bases == BasisPrecision::kQ8 ? 0.55 : 1;
  if (settings.cluster_coefficients) {
    const double part = std::min(1.0, static_cast<double>(patch_count) / kSizedPatches);
    sizes.vector += kVectorSize * part;
    sizes.block += kBlockSize * part;
  }
  return sizes;
}

/// What is at each position, by patch.
std::vector<std::int8_t> by_patch(const std::vector<std::int8_t>& at_position,
                                  const ClusterTree& tree) {
  std::vector<std::int8_t> of_patch(at_position.size());
  for (std::size_t k = 0; k < at_position.size(); ++k) of_patch[tree.patch[k]] = at_position[k];
  return of_patch;
}

/// Beyond blocks of low rank.
struct CompressionOptions {
  bool equilibrated = false, nested = false;
};

/// Bases in integers have one step for all patches of a cluster; sweeps work on the light at
/// positions, and do not know cluster coefficients.
CompressionOptions options_of(const HierarchicalSettings& settings) {
  return {.equilibrated = are_integers(hierarchical_precision(settings.precision).bases) ||
                          settings.cluster_coefficients,
          .nested = settings.cluster_coefficients};
}

/// A compressor with all that it looks at.
class Compression {
 public:
  Compression(const SymmetricMatrix& matrix, const PatchTable& patches, Exitances training,
              const PartSizes& sizes, const CompressionOptions& options)
      : matrix_(matrix),
        sizes_(sizes),
        nested_(options.nested),
        truth_(matrix, with_uniform(patches.size(), training)),
        frame_(frame_of(matrix, patches, truth_)) {
    if (!options.equilibrated) return;
    exponent_ = frame_.balance();
    equilibrated_.emplace(matrix, by_patch(exponent_, frame_.tree));
  }

  HierarchicalStorage at(double multiplier, const KeptParts& kept, const Progress& progress) const {
    const std::vector<ClusterWeight> weights = frame_.weights();
    const BlockTreeCompressor compressor(equilibrated_ ? *equilibrated_ : matrix_, frame_.tree,
                                         weights, sizes_);
    const std::vector<BlockPiece> pieces = compressor.pieces();
    const std::size_t together = kept.checkpoint.keeps() ? kKeptPieces : pieces.size();
    const auto all = static_cast<double>(pieces.size());
    BlockPart whole;
    for (std::size_t begin = 0; begin < pieces.size(); begin += together) {
      const std::size_t end = std::min(pieces.size(), begin + together);
      const auto some = std::span(pieces).subspan(begin, end - begin);
      const Progress part = part_of(progress, static_cast<double>(begin) / all, end / all);
      whole.append(kept.checkpoint.find_or_make(
          fmt::format("{}_part_{:04}", kept.prefix, begin / together),
          [&] { return compressor.compress(some, multiplier, part); }));
      report_progress(part, 1);
    }
    HierarchicalStorage storage = compressor.assemble(std::move(whole));
    if (nested_) {
      const CompressionCost cost{.multiplier = multiplier, .sizes = sizes_};
      const WantedBlocks wanted(frame_.roles, frame_.tree);
      storage = nest_bases(std::move(storage), {frame_.tree, weights, wanted, cost});
    }
    storage.scale_exponent = exponent_;
    return storage;
  }

  double multiplier_for(double usual) const { return frame_.multiplier_for(usual); }

  /// Gives the training lights weight by the errors that they have with `transfer`.
  void emphasise(const TransferOperator& transfer) {
    const std::vector<double> errors = truth_.errors(transfer);
    const double usual = mean(errors);
    if (usual == 0) return;
    for (std::size_t k = 0; k < errors.size(); ++k) {
      frame_.sample.col(static_cast<Eigen::Index>(k)) *=
          std::clamp(errors[k] / usual, kLeastEmphasis, kMostEmphasis);
    }
  }

 private:
  const SymmetricMatrix& matrix_;
  PartSizes sizes_;
  bool nested_;
  ReferenceLighting truth_;
  CompressionFrame frame_;
  std::vector<std::int8_t> exponent_;  ///< by position, as EquilibratedMatrix has them
  std::optional<EquilibratedMatrix> equilibrated_;
};

/// The best operator that the search has met: the smallest within the limit, or the most exact.
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

/// The multiplier that a search begins with.
double search_start(const HierarchicalSettings& settings, std::size_t patch_count) {
  const double usual = initial_multiplier(settings.tolerance, patch_count);
  if (!settings.cluster_coefficients) return kPlainStart * usual;
  const double times = static_cast<double>(patch_count) / kStartPatches;
  return usual * std::clamp(std::pow(times, kStartGrowth), 1.0, kHighestStart);
}

}  // namespace

std::vector<std::int8_t> CompressionFrame::balance() {
  std::vector<std::int8_t> exponent(tree.patch.size());
  for (std::size_t k = 0; k < exponent.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double power = -std::round(std::log2(background[row]));
    exponent[k] = static_cast<std::int8_t>(power);
    sample.row(row) *= std::exp2(power);
    background[row] *= std::exp2(power);
  }
  return exponent;
}

CompressionFrame compression_frame(const SymmetricMatrix& matrix, const PatchTable& patches,
                                   Exitances training) {
  return frame_of(matrix, patches,
                  ReferenceLighting(matrix, with_uniform(patches.size(), training)));
}

double initial_multiplier(double tolerance, std::size_t patch_count) {
  return kInitialMultiplier * tolerance * tolerance / static_cast<double>(patch_count);
}

HierarchicalStorage compress_matrix(const SymmetricMatrix& matrix, const PatchTable& patches,
                                    Exitances training, double multiplier,
                                    const Progress& progress) {
  return Compression(matrix, patches, training, PartSizes(), CompressionOptions())
      .at(multiplier, {BlockCheckpoint(), {}}, progress);
}

std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches, const FittingLights& lights,
    const HierarchicalSettings& settings, const Progress& progress,
    const BlockCheckpoint& checkpoint) {
  const ReferenceLighting validation = validation_truth(matrix, lights.validation);
  Compression compression(matrix, patches, lights.training, part_sizes(settings, patches.size()),
                          options_of(settings));
  const double tolerance = settings.tolerance;
  MultiplierSearch search(compression.multiplier_for(search_start(settings, patches.size())),
                          {kAim * tolerance, kMost * tolerance});
  Best best(kMost * tolerance);
  for (int round = 0; round < kMostRounds && !search.done(); ++round) {
    const Progress part = part_of(progress, part_of_search(round), part_of_search(round + 1));
    const KeptParts kept{checkpoint, fmt::format("round_{}", round)};
    const auto candidate = std::make_shared<const HierarchicalOperator>(
        encode_values(compression.at(search.multiplier(), kept, part), settings.precision));
    const double error = validation_error(validation.errors(*candidate));
    best.offer(candidate, error);
    search.report(error, static_cast<double>(candidate->bytes()));
    if (!search.done()) compression.emphasise(*candidate);
  }
  return best.take();
}

}  // namespace rebounce

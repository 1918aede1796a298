#include "precompute/compression/matrix_compression.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "precompute/compression/nested_bases.h"
#include "precompute/compression/wanted_blocks.h"

namespace rebounce {
namespace {

// Positions in a leaf of the cluster tree.
constexpr std::uint32_t kLeafSize = 32;  // lab/050: 64 take more bytes, 16 twice the time

// Pieces of a round in one checkpoint file: some seconds of work where pieces are largest, and
// enough for many threads to share.
constexpr std::size_t kKeptPieces = 64;

// When training lights are emphasised, the strength of each changes by a factor between these
// (lab/047).
constexpr double kLeastEmphasis = 0.5, kMostEmphasis = 4;

// The uniform light's share of the energy of all training lights. It makes black surfaces, which
// reflect no light, exact enough as lamps (lab/043).
constexpr double kUniformShare = 0.1;

// A light that joins makes rounding finer at positions where it has more than this multiple of the
// usual energy of all training lights at a position, by 2^kFinest at most (lab/136).
constexpr double kConcentrated = 16;
constexpr int kFinest = 8;

using Lights = std::vector<std::vector<Float3>>;

/// `lights`, after one under which every patch, black ones too, gives off the same.
Lights with_uniform(std::size_t patch_count, Lights lights) {
  lights.emplace(lights.begin(), patch_count, Float3{1, 1, 1});
  return lights;
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
  frame.group = matrix.group();
  frame.tree =
      build_cluster_tree(patches, kLeafSize, kAlignment, tree_groups(frame.roles, frame.group));
  frame.background = background_light(matrix, frame.tree);
  frame.sample = training.normalised_lights(frame.tree.patch,
                                            HierarchicalFormat::position_count(patches.size()));
  frame.sample.col(0) *= std::sqrt(kUniformShare * static_cast<double>(frame.sample.cols()));
  return frame;
}

/// What is at each position, by patch.
std::vector<std::int8_t> by_patch(const std::vector<std::int8_t>& at_position,
                                  const ClusterTree& tree) {
  std::vector<std::int8_t> of_patch(at_position.size());
  for (std::size_t k = 0; k < at_position.size(); ++k) of_patch[tree.patch[k]] = at_position[k];
  return of_patch;
}

}  // namespace

std::vector<std::int8_t> CompressionFrame::balance() {
  std::vector<std::int8_t> exponent(tree.patch.size());
  for (std::size_t k = 0; k < exponent.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double power = -std::round(std::log2(background[row]));
    exponent[k] = static_cast<std::int8_t>(power);
  }
  scale(exponent);
  return exponent;
}

void CompressionFrame::scale(std::span<const std::int8_t> exponent) {
  for (std::size_t k = 0; k < exponent.size(); ++k) {
    const double factor = std::exp2(exponent[k]);
    sample.row(static_cast<Eigen::Index>(k)) *= factor;
    background[static_cast<Eigen::Index>(k)] *= factor;
  }
}

CompressionFrame compression_frame(const SymmetricMatrix& matrix, const PatchTable& patches,
                                   std::span<const std::vector<Float3>> training) {
  Lights lights = with_uniform(patches.size(), {training.begin(), training.end()});
  return frame_of(matrix, patches, ReferenceLighting(matrix, std::move(lights)));
}

MatrixCompression::MatrixCompression(const SymmetricMatrix& matrix, const PatchTable& patches,
                                     Lights training, const PartSizes& sizes,
                                     const CompressionOptions& options)
    : matrix_(matrix),
      sizes_(sizes),
      nested_(options.nested),
      truth_(matrix, with_uniform(patches.size(), std::move(training))),
      frame_(frame_of(matrix, patches, truth_)) {
  if (!options.equilibrated) return;
  exponent_ = frame_.balance();
  finer_.assign(exponent_.size(), 0);
  equilibrated_.emplace(matrix, by_patch(exponent_, frame_.tree));
}

HierarchicalStorage MatrixCompression::at(double multiplier, const KeptParts& kept,
                                          const Progress& progress) const {
  const std::vector<ClusterWeight> weights = frame_.weights();
  const BlockTreeCompressor compressor(equilibrated_ ? *equilibrated_ : matrix_, frame_.tree,
                                       weights, sizes_);
  const std::vector<BlockPiece> pieces = compressor.pieces();
  const std::size_t together = kept.checkpoint.keeps() ? kKeptPieces : pieces.size();
  const auto all = static_cast<double>(pieces.size());
  std::vector<BlockPart> parts;
  for (std::size_t begin = 0; begin < pieces.size(); begin += together) {
    const std::size_t end = std::min(pieces.size(), begin + together);
    const auto some = std::span(pieces).subspan(begin, end - begin);
    const Progress part = part_of(progress, static_cast<double>(begin) / all, end / all);
    parts.push_back(
        kept.checkpoint.find_or_make(fmt::format("{}_part_{:04}", kept.prefix, begin / together),
                                     [&] { return compressor.compress(some, multiplier, part); }));
    report_progress(part, 1);
  }
  HierarchicalStorage storage = compressor.assemble(joined(std::move(parts)));
  if (nested_) {
    const CompressionCost cost{.multiplier = multiplier, .sizes = sizes_};
    const WantedBlocks wanted(frame_.roles, frame_.tree);
    storage = nest_bases(std::move(storage), {frame_.tree, weights, wanted, cost});
  }
  storage.scale_exponent = exponent_;
  return storage;
}

void MatrixCompression::emphasise(const TransferOperator& transfer) {
  const std::vector<double> errors = truth_.errors(transfer);
  const double usual = mean(errors);
  if (usual == 0) return;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    frame_.sample.col(static_cast<Eigen::Index>(k)) *=
        std::clamp(errors[k] / usual, kLeastEmphasis, kMostEmphasis);
  }
}

void MatrixCompression::add_training_light(const ReferenceLighting& lights, std::size_t k) {
  truth_.append(lights, k);
  const Eigen::Index last = frame_.sample.cols();
  frame_.sample.conservativeResize(Eigen::NoChange, last + 1);
  frame_.sample.col(last) =
      truth_.normalised_light(truth_.light_count() - 1, frame_.tree.patch, frame_.sample.rows());
  if (!equilibrated_) return;
  for (std::size_t i = 0; i < frame_.tree.patch.size(); ++i) {
    frame_.sample(static_cast<Eigen::Index>(i), last) *=
        std::exp2(static_cast<float>(exponent_[i]));
  }
  round_finer_where_lit();
}

void MatrixCompression::round_finer_where_lit() {
  const Eigen::MatrixXd& sample = frame_.sample;
  const Eigen::VectorXd inverse = frame_.background.cwiseAbs2().cwiseInverse();
  const double usual =
      sample.rowwise().squaredNorm().dot(inverse) / static_cast<double>(sample.rows());
  if (!(usual > 0)) return;
  std::vector<std::int8_t> change(exponent_.size(), 0);
  for (std::size_t i = 0; i < change.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double value = sample(row, sample.cols() - 1);
    const double energy = value * value * inverse[row] / usual;
    if (!(energy > kConcentrated)) continue;
    const int wanted = std::min<int>(std::lround(std::log2(1 + energy) / 2), kFinest);
    change[i] = static_cast<std::int8_t>(std::min(0, finer_[i] - wanted));
    finer_[i] = static_cast<std::int8_t>(finer_[i] - change[i]);
    exponent_[i] = static_cast<std::int8_t>(exponent_[i] + change[i]);
  }
  frame_.scale(change);
  equilibrated_.emplace(matrix_, by_patch(exponent_, frame_.tree));
}

HierarchicalStorage compress_matrix(const SymmetricMatrix& matrix, const PatchTable& patches,
                                    std::span<const std::vector<Float3>> training,
                                    double multiplier, const Progress& progress) {
  return MatrixCompression(matrix, patches, {training.begin(), training.end()})
      .at(multiplier, {BlockCheckpoint(), {}}, progress);
}

}  // namespace rebounce

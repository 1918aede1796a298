#include "rebounce/precompute/hierarchical_transfer.h"

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "block_compression.h"
#include "cluster_tree.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"
#include "single_threaded_blas.h"
#include "symmetric_matrix.h"

namespace rebounce {
namespace {

using Eigen::Index;

// Measured: notes/operator.md.
constexpr std::uint32_t kLeafSize = 32;

// What a block costs beside its values, in values: its description, and the start of its loops.
constexpr double kBlockOverhead = 32;

// Pieces of work: the matrix is gathered and compressed in squares of at most this many rows, and
// of an eighth of all where that is smaller, so that there are enough of them to share.
constexpr std::uint32_t kLargestPiece = 2048, kSmallestPiece = 512;

// How much more the uniform part of light counts than any other, for a cluster of kLeafSize
// positions. Measured: notes/operator.md.
constexpr double kUniformStress = 1;

/// I + s u u^T for the unit vector u over a cluster that uniform light is. Lights are smooth: of
/// the energy that falls on a cluster, most is uniform, and the more so the more patches it has. An
/// error in what uniform light does therefore weighs more than others, and singular vectors are
/// those of the blocks with this on both sides.
class UniformStress {
 public:
  UniformStress(const Cluster& cluster, const ClusterTree& tree, const std::vector<float>& area)
      : uniform_(Eigen::VectorXd::Zero(cluster.count)),
        strength_(kUniformStress * std::sqrt(static_cast<double>(cluster.count) / kLeafSize)) {
    for (std::uint32_t i = 0; i < cluster.count; ++i) {
      const std::size_t position = cluster.begin + i;
      if (position < tree.patch.size()) uniform_[i] = std::sqrt(area[tree.patch[position]]);
    }
    uniform_.normalize();
  }

  template <typename Matrix>
  void put_left(Matrix&& matrix) const {
    const Eigen::RowVectorXd part = uniform_.transpose() * matrix;
    matrix += (strength_ * uniform_) * part;
  }

  template <typename Matrix>
  void put_right(Matrix&& matrix) const {
    const Eigen::VectorXd part = matrix * uniform_;
    matrix += part * (strength_ * uniform_.transpose());
  }

  void take_away(Eigen::MatrixXd& basis) const {
    const Eigen::RowVectorXd part = uniform_.transpose() * basis;
    basis -= (strength_ / (1 + strength_) * uniform_) * part;
  }

 private:
  Eigen::VectorXd uniform_;
  double strength_;
};

/// A part of the operator: blocks in the order of traversal and what they hold.
struct Part {
  std::vector<TransferBlock> blocks;
  std::vector<float> values;
  double cost = 0;

  void append(Part&& other) {
    blocks.insert(blocks.end(), other.blocks.begin(), other.blocks.end());
    values.insert(values.end(), other.values.begin(), other.values.end());
    cost += other.cost;
  }
};

void append_columns(const Eigen::MatrixXd& matrix, std::vector<float>& values) {
  for (Index k = 0; k < matrix.size(); ++k) values.push_back(static_cast<float>(matrix.data()[k]));
}

void append_rows(const Eigen::MatrixXd& matrix, std::vector<float>& values) {
  append_columns(matrix.transpose(), values);
}

/// Compresses one square of the matrix, below or on the diagonal.
class PieceCompressor {
 public:
  PieceCompressor(const SymmetricMatrix& matrix, const std::vector<float>& area,
                  const ClusterTree& tree, double price, const Cluster& row, const Cluster& column)
      : area_(area), tree_(tree), price_(price), row_(row), column_(column) {
    const auto rows = patches_of(row), columns = patches_of(column);
    for (std::uint32_t m = 0; m < matrix.matrix_count(); ++m) {
      Eigen::MatrixXf& entries =
          matrices_.emplace_back(Eigen::MatrixXf::Zero(row.count, column.count));
      matrix.entries(m, rows, columns,
                     entries.topLeftCorner(static_cast<Index>(rows.size()),
                                           static_cast<Index>(columns.size())));
    }
  }

  Part compress() const { return compress(row_, column_); }

 private:
  /// Those of a cluster's positions that hold one.
  std::span<const std::uint32_t> patches_of(const Cluster& cluster) const {
    const std::size_t end =
        std::min<std::size_t>(cluster.begin + cluster.count, tree_.patch.size());
    return {tree_.patch.data() + cluster.begin, tree_.patch.data() + end};
  }

  Index matrix_count() const { return static_cast<Index>(matrices_.size()); }

  WideBlock wide_block(const Cluster& row, const Cluster& column) const {
    WideBlock block;
    block.matrix_count = matrix_count();
    block.on_diagonal = row.begin == column.begin;
    block.entries.resize(row.count, matrix_count() * column.count);
    for (Index m = 0; m < matrix_count(); ++m) {
      block.entries.middleCols(m * column.count, column.count) =
          matrices_[m]
              .block(row.begin - row_.begin, column.begin - column_.begin, row.count, column.count)
              .cast<double>();
    }
    return block;
  }

  Part compress(const Cluster& row, const Cluster& column) const {
    WideBlock block = wide_block(row, column);
    const UniformStress row_stress(row, tree_, area_), column_stress(column, tree_, area_);
    row_stress.put_left(block.entries);
    for (Index m = 0; m < matrix_count(); ++m) {
      column_stress.put_right(block.entries.middleCols(m * column.count, column.count));
    }
    const CompressionCost cost{price_, block.on_diagonal ? 1.0 : 2.0};
    const TransferBlock place{.row_begin = row.begin,
                              .row_count = row.count,
                              .column_begin = column.begin,
                              .column_count = column.count};
    const double zero_cost = cost.total(block.entries.squaredNorm(), kBlockOverhead);
    const double overhead = price_ * kBlockOverhead;
    if (zero_cost <= 2 * overhead) return zero_part(place, zero_cost);
    Part best = row.is_leaf() && column.is_leaf() ? dense_part(place, wide_block(row, column))
                                                  : compress_children(row, column);
    if (zero_cost <= best.cost) best = zero_part(place, zero_cost);
    const std::uint64_t seed = (std::uint64_t{row.begin} << 32) + column.begin + row.count;
    auto low_rank = compress_block(block, cost, best.cost - overhead, seed);
    if (!low_rank) return best;
    row_stress.take_away(low_rank->row_basis);
    if (!block.on_diagonal) column_stress.take_away(low_rank->column_basis);
    return low_rank_part(place, *low_rank, cost);
  }

  Part compress_children(const Cluster& row, const Cluster& column) const {
    Part part;
    const auto child = [&](const Cluster& cluster, std::uint32_t k) -> const Cluster& {
      return cluster.is_leaf() ? cluster : tree_.clusters[cluster.first_child + k];
    };
    const bool diagonal = row.begin == column.begin;
    for (std::uint32_t r = 0; r < (row.is_leaf() ? 1U : 2U); ++r) {
      for (std::uint32_t c = 0; c < (column.is_leaf() ? 1U : 2U); ++c) {
        if (diagonal && c > r) continue;
        part.append(compress(child(row, r), child(column, c)));
      }
    }
    return part;
  }

  static Part zero_part(TransferBlock place, double cost) {
    place.kind = TransferBlock::Kind::kLowRank;
    return {{place}, {}, cost};
  }

  Part dense_part(const TransferBlock& place, const WideBlock& block) const {
    Part part{{place}, {}, 0};
    for (Index m = 0; m < block.matrix_count; ++m) append_rows(block.matrix(m), part.values);
    part.cost = price_ * (kBlockOverhead + static_cast<double>(part.values.size()));
    return part;
  }

  Part low_rank_part(TransferBlock place, const LowRankBlock& block,
                     const CompressionCost& cost) const {
    place.kind = TransferBlock::Kind::kLowRank;
    place.row_rank = static_cast<std::uint32_t>(block.row_basis.cols());
    place.column_rank = place.on_diagonal() ? place.row_rank
                                            : static_cast<std::uint32_t>(block.column_basis.cols());
    Part part{{place}, {}, 0};
    append_columns(block.row_basis, part.values);
    append_columns(block.column_basis, part.values);
    for (const Eigen::MatrixXd& core : block.cores) append_rows(core, part.values);
    part.cost =
        cost.total(block.error_squared, kBlockOverhead + static_cast<double>(part.values.size()));
    return part;
  }

  const std::vector<float>& area_;
  const ClusterTree& tree_;
  double price_;
  Cluster row_, column_;
  std::vector<Eigen::MatrixXf> matrices_;
};

struct Piece {
  Cluster row, column;
};

/// The lower triangle as pieces, in the order of traversal.
void add_pieces(const ClusterTree& tree, const Cluster& row, const Cluster& column,
                std::uint32_t largest, std::vector<Piece>& pieces) {
  const bool split_row = row.count > largest && !row.is_leaf();
  const bool split_column = column.count > largest && !column.is_leaf();
  if (!split_row && !split_column) {
    pieces.push_back({row, column});
    return;
  }
  const bool diagonal = row.begin == column.begin;
  for (std::uint32_t r = 0; r < (split_row ? 2U : 1U); ++r) {
    for (std::uint32_t c = 0; c < (split_column ? 2U : 1U); ++c) {
      if (diagonal && c > r) continue;
      add_pieces(tree, split_row ? tree.clusters[row.first_child + r] : row,
                 split_column ? tree.clusters[column.first_child + c] : column, largest, pieces);
    }
  }
}

// The search for the price ends with an error between these parts of the tolerance: other lights
// than those that it sees may do a little worse. Errors are about proportional to the root of the
// price.
constexpr int kMostRounds = 5;
constexpr double kLeast = 0.6, kAim = 0.7, kMost = 0.8;

// The largest error may be this many times the tolerance: gates of 0.5 % and 1.5 %.
constexpr double kLargestOverMean = 3;

/// Compares operators with the matrix that they stand for under given lights.
class TestLights {
 public:
  TestLights(const SymmetricMatrix& matrix, const PatchTable& patches,
             std::span<const std::vector<Float3>> lights)
      : area_(patches.area) {
    for (const std::vector<Float3>& light : lights) {
      if (area_norm(light, area_) > 0) lights_.push_back(light);
    }
    if (lights_.empty()) lights_.emplace_back(patches.size(), Float3{1, 1, 1});
    for (const std::vector<Float3>& light : lights_) truths_.push_back(matrix.multiply(light));
  }

  /// The mean error, or the largest by kLargestOverMean if that is more.
  double error(const TransferOperator& transfer) const {
    double sum = 0, largest = 0;
    for (std::size_t k = 0; k < lights_.size(); ++k) {
      const double e = relative_difference(product(transfer, lights_[k]), truths_[k], area_);
      sum += e;
      largest = std::max(largest, e);
    }
    return std::max(sum / static_cast<double>(lights_.size()), largest / kLargestOverMean);
  }

 private:
  static std::vector<Float3> product(const TransferOperator& transfer,
                                     const std::vector<Float3>& light) {
    std::vector<float> workspace(transfer.workspace_size());
    std::vector<Float3> result(light.size());
    transfer.apply(light, result, workspace);
    return result;
  }

  const std::vector<float>& area_;
  std::vector<std::vector<Float3>> lights_, truths_;
};

/// What a value is worth at a tolerance, to begin the search with.
double first_price(const SymmetricMatrix& matrix, std::size_t patch_count, double tolerance) {
  constexpr double kValuesPerPatch = 300;  // measured: notes/operator.md
  return tolerance * tolerance * matrix.norm_squared() /
         (kValuesPerPatch * static_cast<double>(patch_count));
}

}  // namespace

HierarchicalOperator::Storage compress_matrix(const SymmetricMatrix& matrix,
                                              const PatchTable& patches, double price,
                                              const Progress& progress) {
  const SingleThreadedBlas single_threaded;
  const ClusterTree tree = build_cluster_tree(patches, kLeafSize);
  const Cluster& root = tree.clusters.front();
  std::vector<Piece> pieces;
  add_pieces(tree, root, root, std::clamp(root.count / 8, kSmallestPiece, kLargestPiece), pieces);
  std::vector<Part> parts(pieces.size());
  std::atomic<std::size_t> done = 0;
  std::atomic<bool> stop = false;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    if (stop) continue;
    parts[k] = PieceCompressor(matrix, patches.area, tree, price, pieces[k].row, pieces[k].column)
                   .compress();
    const double fraction = static_cast<double>(++done) / static_cast<double>(pieces.size());
    if (progress && omp_get_thread_num() == 0 && !progress(fraction)) stop = true;
  }
  if (stop || (progress && !progress(1))) throw Cancelled();

  Part whole;
  for (Part& part : parts) whole.append(std::move(part));
  whole.values.resize(whole.values.size() + HierarchicalOperator::kPadding, 0.0F);
  HierarchicalOperator::Storage storage;
  storage.area = patches.area;
  storage.patch = tree.patch;
  storage.channel_matrix = matrix.channel_matrix();
  storage.matrix_count = matrix.matrix_count();
  storage.blocks = std::move(whole.blocks);
  storage.values_f32 = SharedArray(std::move(whole.values));
  return storage;
}

HierarchicalOperator::Storage compress_transfer(const DenseOperator& dense,
                                                const PatchTable& patches, double price,
                                                const Progress& progress) {
  return compress_matrix(DenseMatrix(dense), patches, price, progress);
}

std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches,
    std::span<const std::vector<Float3>> test_lights, const HierarchicalSettings& settings,
    const Progress& progress) {
  const TestLights lights(matrix, patches, test_lights);
  std::shared_ptr<const HierarchicalOperator> best;
  double best_error = 0, price = first_price(matrix, patches.size(), settings.tolerance);
  for (int round = 0; round < kMostRounds; ++round) {
    Progress part;
    if (progress) part = [&](double done) { return progress((round + done) / kMostRounds); };
    const HierarchicalOperator::Storage storage = compress_matrix(matrix, patches, price, part);
    auto candidate = std::make_shared<const HierarchicalOperator>(
        HierarchicalOperator::encode(storage, settings.precision));
    const double error = lights.error(*candidate);
    const bool within = error <= kMost * settings.tolerance;
    const bool best_within = best && best_error <= kMost * settings.tolerance;
    if (!best || (within && (!best_within || candidate->bytes() < best->bytes())) ||
        (!within && !best_within && error < best_error)) {
      best = std::move(candidate);
      best_error = error;
    }
    if (within && error >= kLeast * settings.tolerance) break;
    // An error of nothing means that everything is stored; a price of a thousand times more is a
    // bold enough next step.
    const double step = error > 0 ? kAim * settings.tolerance / error : 32;
    price *= std::clamp(step * step, 1e-3, 1e3);
  }
  return best;
}

std::shared_ptr<const HierarchicalOperator> build_hierarchical_transfer(
    const DenseOperator& dense, const PatchTable& patches,
    std::span<const std::vector<Float3>> test_lights, const HierarchicalSettings& settings,
    const Progress& progress) {
  return compress_to_tolerance(DenseMatrix(dense), patches, test_lights, settings, progress);
}

}  // namespace rebounce

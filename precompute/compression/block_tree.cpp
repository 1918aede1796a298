#include "precompute/compression/block_tree.h"

#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "precompute/base/blas.h"
#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/base/process_memory.h"
#include "precompute/compression/block_compression.h"
#include "precompute/compression/residual_ranks.h"

namespace rebounce {
namespace {

using Eigen::Index;

// The largest and the smallest side of a piece of the matrix that is read and compressed at a time.
constexpr std::uint32_t kLargestPiece = 2048, kSmallestPiece = 512;

// The largest side of a block that is read where the matrix is known as a sum of parts.
constexpr std::uint32_t kLargestRead = 512;  // lab/180

// A block is smooth if its best ranks stay below this fraction of its sides. Splitting it would
// only store the same few functions several times (lab/052).
constexpr Index kSmoothPart = 16;

// Values of parts that are copied before their memory is given back, a quarter of a GiB.
constexpr std::size_t kValuesGivenBack = 1 << 26;

void append_columns(const Eigen::MatrixXf& matrix, std::vector<float>& values) {
  values.insert(values.end(), matrix.data(), matrix.data() + matrix.size());
}

void append_rows(const Eigen::MatrixXf& matrix, std::vector<float>& values) {
  append_columns(matrix.transpose(), values);
}

/// Makes the columns of `basis` orthonormal, by Householder QR. Returns R: the old basis is the new
/// basis times R.
Eigen::MatrixXd make_orthonormal(Eigen::MatrixXd& basis) {
  const Index rank = basis.cols();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(basis);
  Eigen::MatrixXd factor = qr.matrixQR().topRows(rank).template triangularView<Eigen::Upper>();
  basis = qr.householderQ() * Eigen::MatrixXd::Identity(basis.rows(), rank);
  return factor;
}

/// Compresses one piece of the matrix, below or on the diagonal.
class PieceCompressor {
 public:
  PieceCompressor(const SymmetricMatrix& matrix, const ClusterTree& tree,
                  const std::vector<ClusterWeight>& weights, const WantedBlocks& wanted,
                  const PartSizes& sizes, double multiplier, ParallelProgress& loop)
      : loop_(loop),
        tree_(tree),
        weights_(weights),
        wanted_(wanted),
        sizes_(sizes),
        multiplier_(multiplier),
        matrix_(matrix) {}

  /// A block of the piece, which may be all of it. Where the matrix is known as a sum of parts, the
  /// entries of large blocks are not read.
  BlockPart compress(std::uint32_t row, std::uint32_t column) {
    if (loop_.look() || !wanted_.wanted(row, column)) return {};
    const auto rows = patches_of(tree_, tree_.clusters[row]),
               columns = patches_of(tree_, tree_.clusters[column]);
    if (matrix_.is_zero(rows, columns)) {
      return zero_part(place_of(row, column), multiplier_ * sizes_.block);
    }
    if (!matrix_.has_parts() || !is_large(row, column)) {
      gather(row, column);
      return compress_entries(row, column);
    }
    const std::optional<StructuredBlock> block = structured_block(row, column);
    const double energy = block ? block->energy() : std::numeric_limits<double>::infinity();
    if (block) {
      BlockAttempt attempt;
      std::optional<BlockPart> part = compress_smooth(*block, energy, {row, column}, attempt);
      if (part) return std::move(*part);
    }
    BlockPart best = compress_children(
        row, column, [&](std::uint32_t r, std::uint32_t c) { return compress(r, c); });
    const double zero_cost = cost_of(row, column).total(energy, sizes_.block);
    return zero_cost <= best.cost ? zero_part(place_of(row, column), zero_cost) : best;
  }

 private:
  bool is_large(std::uint32_t row, std::uint32_t column) const {
    return std::max(tree_.clusters[row].count, tree_.clusters[column].count) > kLargestRead &&
           !are_leaves(row, column);
  }

  void gather(std::uint32_t of_row, std::uint32_t of_column) {
    const Cluster &row = tree_.clusters[of_row], &column = tree_.clusters[of_column];
    const auto rows = patches_of(tree_, row), columns = patches_of(tree_, column);
    row_begin_ = row.begin;
    column_begin_ = column.begin;
    matrices_ = matrix_.all_entries(rows, columns);
    for (Eigen::MatrixXf& entries : matrices_) {
      wanted_.clear_unwanted(rows, columns, entries);
      // Positions at the end of a cluster may hold no patch.
      if (entries.rows() == row.count && entries.cols() == column.count) continue;
      Eigen::MatrixXf padded = Eigen::MatrixXf::Zero(row.count, column.count);
      padded.topLeftCorner(entries.rows(), entries.cols()) = entries;
      entries = std::move(padded);
    }
  }

  /// A weighted block that is not read.
  std::optional<StructuredBlock> structured_block(std::uint32_t row, std::uint32_t column) const {
    if (wanted_.is_mixed(row) || wanted_.is_mixed(column)) return std::nullopt;
    const Cluster &rows = tree_.clusters[row], &columns = tree_.clusters[column];
    auto parts = matrix_.parts(patches_of(tree_, rows), patches_of(tree_, columns));
    if (!parts) return std::nullopt;
    return StructuredBlock(std::move(*parts),
                           {.rows = rows.count,
                            .columns = columns.count,
                            .row_weight = weight_of(row, column),
                            .column_weight = weight_of(column, row),
                            .on_diagonal = row == column},
                           seed_of(place_of(row, column)));
  }

  Index matrix_count() const { return static_cast<Index>(matrices_.size()); }

  /// Entries of a matrix in a block of the piece.
  auto entries_of(const Eigen::MatrixXf& matrix, const TransferBlock& place) const {
    return matrix.block(place.row_begin - row_begin_, place.column_begin - column_begin_,
                        place.row_count, place.column_count);
  }

  bool is_zero(const TransferBlock& place) const {
    return std::ranges::all_of(matrices_, [&](const Eigen::MatrixXf& matrix) {
      return (entries_of(matrix, place).array() == 0).all();
    });
  }

  WideBlock wide_block(const TransferBlock& place) const {
    WideBlock block;
    block.matrix_count = matrix_count();
    block.on_diagonal = place.on_diagonal();
    block.entries.resize(place.row_count, matrix_count() * place.column_count);
    for (Index m = 0; m < matrix_count(); ++m) {
      block.entries.middleCols(m * place.column_count, place.column_count) =
          entries_of(matrices_[m], place).cast<double>();
    }
    return block;
  }

  WideBlock weighted_block(const TransferBlock& place, std::uint32_t row,
                           std::uint32_t column) const {
    WideBlock block = wide_block(place);
    if (const auto* weight = weight_of(row, column)) weight->weigh_rows(block.entries);
    const ClusterWeight* const column_weight = weight_of(column, row);
    if (column_weight == nullptr) return block;
    for (Index m = 0; m < matrix_count(); ++m) {
      column_weight->weigh_columns(
          block.entries.middleCols(m * place.column_count, place.column_count));
    }
    return block;
  }

  /// The number of directions, 1 or 2, in which light passes through a block.
  double multiplicity(std::uint32_t row, std::uint32_t column) const {
    return row != column && wanted_.leads(row, column) && wanted_.leads(column, row) ? 2 : 1;
  }

  TransferBlock place_of(std::uint32_t row, std::uint32_t column) const {
    const Cluster &rows = tree_.clusters[row], &columns = tree_.clusters[column];
    return {.row_begin = rows.begin,
            .row_count = rows.count,
            .column_begin = columns.begin,
            .column_count = columns.count};
  }

  CompressionCost cost_of(std::uint32_t row, std::uint32_t column) const {
    return {.multiplier = multiplier_, .multiplicity = multiplicity(row, column), .sizes = sizes_};
  }

  static std::uint64_t seed_of(const TransferBlock& place) {
    return (std::uint64_t{place.row_begin} << 32) + place.column_begin + place.row_count;
  }

  /// A block of this energy as zero or as smooth, if it is; what was tried is in `attempt`.
  template <typename Block>
  std::optional<BlockPart> compress_smooth(const Block& block, double energy, const BlockPiece& at,
                                           BlockAttempt& attempt) const {
    const TransferBlock place = place_of(at.row, at.column);
    const CompressionCost cost = cost_of(at.row, at.column);
    const double overhead = multiplier_ * sizes_.block;
    const double zero_cost = cost.total(energy, sizes_.block);
    if (zero_cost <= 2 * overhead) return zero_part(place, zero_cost);
    const Index smooth = std::min(block.rows(), block.columns()) / kSmoothPart;
    if (smooth == 0 || are_leaves(at.row, at.column)) return std::nullopt;
    attempt = compress_block(block, cost, zero_cost - overhead, smooth, seed_of(place));
    const bool is_smooth = attempt.block && attempt.block->row_basis.cols() < smooth &&
                           attempt.block->column_basis.cols() < smooth;
    if (!is_smooth) return std::nullopt;
    return low_rank_part(place, *attempt.block, at.row, at.column, cost);
  }

  bool are_leaves(std::uint32_t row, std::uint32_t column) const {
    return tree_.clusters[row].is_leaf() && tree_.clusters[column].is_leaf();
  }

  /// A block whose entries are read.
  BlockPart compress_entries(std::uint32_t row, std::uint32_t column) const {
    if (loop_.look() || !wanted_.wanted(row, column)) return {};
    const auto children = [&] {
      return compress_children(
          row, column, [&](std::uint32_t r, std::uint32_t c) { return compress_entries(r, c); });
    };
    if (wanted_.is_mixed(row) || wanted_.is_mixed(column)) return children();
    const TransferBlock place = place_of(row, column);
    const double overhead = multiplier_ * sizes_.block;
    if (is_zero(place)) return zero_part(place, overhead);
    const WideBlock block = weighted_block(place, row, column);
    const CompressionCost cost = cost_of(row, column);
    const double energy = block.entries.squaredNorm();
    BlockAttempt attempt;
    if (std::optional<BlockPart> part = compress_smooth(block, energy, {row, column}, attempt)) {
      return std::move(*part);
    }
    BlockPart best = are_leaves(row, column) ? dense_part(place) : children();
    const double zero_cost = cost.total(energy, sizes_.block);
    if (zero_cost <= best.cost) best = zero_part(place, zero_cost);
    const double limit = best.cost - overhead;
    if (attempt.least_beyond < limit) {
      attempt = compress_block(block, cost, limit, block.rows(), seed_of(place));
    } else if (attempt.block && cost.of(*attempt.block) >= limit) {
      return best;
    }
    return attempt.block ? low_rank_part(place, *attempt.block, row, column, cost) : best;
  }

  /// The blocks below a block, each made by `compress_child`.
  template <typename CompressChild>
  BlockPart compress_children(std::uint32_t row, std::uint32_t column,
                              const CompressChild& compress_child) const {
    BlockPart part;
    const auto child = [&](std::uint32_t cluster, std::uint32_t k) {
      const Cluster& c = tree_.clusters[cluster];
      return c.is_leaf() ? cluster : c.first_child + k;
    };
    const std::uint32_t row_children = tree_.clusters[row].is_leaf() ? 1 : 2;
    const std::uint32_t column_children = tree_.clusters[column].is_leaf() ? 1 : 2;
    for (std::uint32_t r = 0; r < row_children; ++r) {
      for (std::uint32_t c = 0; c < column_children; ++c) {
        if (row == column && c > r) continue;
        part.append(compress_child(child(row, r), child(column, c)));
      }
    }
    return part;
  }

  static BlockPart zero_part(TransferBlock place, double cost) {
    place.kind = TransferBlock::Kind::kLowRank;
    return {{place}, {}, cost};
  }

  BlockPart dense_part(const TransferBlock& place) const {
    const WideBlock block = wide_block(place);
    BlockPart part{{place}, {}, 0};
    for (Index m = 0; m < block.matrix_count; ++m)
      append_rows(block.matrix(m).cast<float>(), part.values);
    part.cost = multiplier_ * (sizes_.block + static_cast<double>(part.values.size()));
    return part;
  }

  /// The weight of light that goes from one cluster to another; null if it is not wanted.
  const ClusterWeight* weight_of(std::uint32_t from, std::uint32_t to) const {
    return wanted_.leads(from, to) ? &weights_[from] : nullptr;
  }

  /// Turns the factors of the weighted block into factors of the block itself. The bases are made
  /// orthonormal again, so that bases and coupling matrices stay in the range of half precision.
  void unweigh(LowRankBlock& block, std::uint32_t row, std::uint32_t column) const {
    if (const auto* weight = weight_of(row, column)) weight->unweigh_rows(block.row_basis);
    const Eigen::MatrixXd row_factor = make_orthonormal(block.row_basis);
    Eigen::MatrixXd column_factor = row_factor;
    if (row != column) {
      if (const auto* weight = weight_of(column, row)) weight->unweigh_rows(block.column_basis);
      column_factor = make_orthonormal(block.column_basis);
    }
    for (Eigen::MatrixXd& coupling : block.couplings)
      coupling = row_factor * coupling * column_factor.transpose();
  }

  BlockPart low_rank_part(TransferBlock place, LowRankBlock block, std::uint32_t row,
                          std::uint32_t column, const CompressionCost& cost) const {
    unweigh(block, row, column);
    place.kind = TransferBlock::Kind::kLowRank;
    place.row_rank = static_cast<std::uint32_t>(block.row_basis.cols());
    place.column_rank = place.on_diagonal() ? place.row_rank
                                            : static_cast<std::uint32_t>(block.column_basis.cols());
    const BlockWeights weights{weight_of(row, column), weight_of(column, row)};
    const ResidualRanks ranks = find_residual_ranks(block, weights, cost);
    place.coupling_step = static_cast<float>(coupling_step(block, weights, cost));
    place.row_residual_rank = static_cast<std::uint32_t>(ranks.row);
    place.column_residual_rank = static_cast<std::uint32_t>(ranks.column);
    BlockPart part{{place}, {}, 0};
    append_columns(block.row_basis.cast<float>(), part.values);
    append_columns(block.column_basis.cast<float>(), part.values);
    for (const Eigen::MatrixXd& coupling : block.couplings)
      append_rows(coupling.cast<float>(), part.values);
    part.cost = cost.of(block) + multiplier_ * sizes_.block;
    return part;
  }

  ParallelProgress& loop_;  ///< of the pieces
  const ClusterTree& tree_;
  const std::vector<ClusterWeight>& weights_;
  const WantedBlocks& wanted_;
  const PartSizes& sizes_;
  double multiplier_;
  const SymmetricMatrix& matrix_;
  std::uint32_t row_begin_ = 0, column_begin_ = 0;  ///< of the entries
  std::vector<Eigen::MatrixXf> matrices_;           ///< the entries that are read
};

void add_pieces(const ClusterTree& tree, BlockPiece piece, std::uint32_t largest,
                std::vector<BlockPiece>& pieces) {
  const Cluster &rows = tree.clusters[piece.row], &columns = tree.clusters[piece.column];
  const bool split_row = rows.count > largest && !rows.is_leaf();
  const bool split_column = columns.count > largest && !columns.is_leaf();
  if (!split_row && !split_column) {
    pieces.push_back(piece);
    return;
  }
  for (std::uint32_t r = 0; r < (split_row ? 2U : 1U); ++r) {
    for (std::uint32_t c = 0; c < (split_column ? 2U : 1U); ++c) {
      if (piece.row == piece.column && c > r) continue;
      add_pieces(tree,
                 {split_row ? rows.first_child + r : piece.row,
                  split_column ? columns.first_child + c : piece.column},
                 largest, pieces);
    }
  }
}

}  // namespace

void BlockPart::append(const BlockPart& other) {
  blocks.insert(blocks.end(), other.blocks.begin(), other.blocks.end());
  values.insert(values.end(), other.values.begin(), other.values.end());
  cost += other.cost;
}

BlockPart joined(std::vector<BlockPart> parts) {
  if (parts.size() == 1) return std::move(parts.front());
  std::size_t block_count = 0, value_count = HierarchicalFormat::kPadding;
  for (const BlockPart& part : parts) {
    block_count += part.blocks.size();
    value_count += part.values.size();
  }
  BlockPart whole;
  whole.blocks.reserve(block_count);
  whole.values.reserve(value_count);
  std::size_t ended = 0;
  for (BlockPart& part : parts) {
    whole.append(part);
    ended += std::exchange(part, {}).values.size();
    if (ended < kValuesGivenBack) continue;
    return_freed_memory();
    ended = 0;
  }
  return whole;
}

void share(const Ranks& ranks, std::span<BlockPart> parts) {
  if (ranks.alone()) return;
  std::vector<std::vector<TransferBlock>> blocks;
  std::vector<std::vector<float>> values;
  std::vector<double> costs;
  for (BlockPart& part : parts) {
    blocks.push_back(std::move(part.blocks));
    values.push_back(std::move(part.values));
    costs.push_back(part.cost);
  }
  ranks.share(std::span(blocks));
  ranks.share(std::span(values));
  ranks.share(std::span(costs));
  for (std::size_t k = 0; k < parts.size(); ++k) {
    parts[k] = {std::move(blocks[k]), std::move(values[k]), costs[k]};
  }
}

std::uint32_t largest_piece(std::uint32_t position_count) {
  return std::clamp(position_count / 8, kSmallestPiece, kLargestPiece);
}

std::vector<BlockPiece> block_pieces(const ClusterTree& tree, std::uint32_t largest) {
  std::vector<BlockPiece> pieces;
  add_pieces(tree, {0, 0}, largest, pieces);
  return pieces;
}

std::vector<BlockPiece> BlockTreeCompressor::pieces() const {
  return block_pieces(tree_, largest_piece(tree_.clusters.front().count));
}

BlockPart BlockTreeCompressor::compress(std::span<const BlockPiece> pieces, double multiplier,
                                        const Progress& progress) const {
  load_blas();
  const Ranks ranks;
  std::vector<BlockPart> parts(pieces.size());
  ParallelProgress loop(progress, pieces.size());
  parallel_loop(pieces.size(), [&](std::size_t k) {
    if (loop.stopped() || !ranks.makes(k)) return;
    if (wants(pieces[k])) {
      parts[k] = PieceCompressor(matrix_, tree_, weights_, wanted_, sizes_, multiplier, loop)
                     .compress(pieces[k].row, pieces[k].column);
    }
    loop.advance();
  });
  loop.finish();
  share(ranks, parts);
  return joined(std::move(parts));
}

HierarchicalStorage BlockTreeCompressor::assemble(BlockPart whole) const {
  whole.values.resize(whole.values.size() + HierarchicalFormat::kPadding, 0.0F);
  HierarchicalStorage storage;
  storage.area.assign(matrix_.area().begin(), matrix_.area().end());
  storage.patch = tree_.patch;
  storage.channel_matrix = matrix_.channel_matrix();
  storage.matrix_count = matrix_.matrix_count();
  storage.roles = matrix_.roles();
  storage.blocks = std::move(whole.blocks);
  storage.values_f32 = SharedArray(std::move(whole.values));
  return storage;
}

}  // namespace rebounce

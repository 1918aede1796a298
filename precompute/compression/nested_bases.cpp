#include "precompute/compression/nested_bases.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "precompute/base/blas.h"
#include "precompute/base/eigenvectors.h"
#include "precompute/base/parallel_loop.h"
#include "precompute/compression/residual_ranks.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Storage = HierarchicalStorage;
using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A cell has at most kCell positions. A side of a block can have cluster bases if it consists of
// whole groups, clusters of at most kGroup positions (lab/035).
constexpr std::uint32_t kCell = 128, kGroup = 256;

// The largest entry of a coupling matrix between cluster coefficients: half of the range of half
// precision.
constexpr double kLargestCoupling = 32768 / HierarchicalFormat::kHalfScale;

// The size of the description of a cell, in values.
constexpr double kCellOverhead = 32;

constexpr auto kAlignment = static_cast<Index>(HierarchicalFormat::kAlignment);

/// The clusters that the rows and columns of large blocks are made of, in the order of positions.
struct Cells {
  std::vector<std::uint32_t> cluster;
  std::vector<std::size_t> group_first;  ///< first cell of each group, and their end
  /// First position of each group, and the end of the last.
  std::vector<std::uint32_t> group_position;

  explicit Cells(const ClusterTree& tree) {
    add(tree, 0, false);
    group_first.push_back(cluster.size());
    group_position.push_back(tree.clusters.front().begin + tree.clusters.front().count);
  }

 private:
  void add(const ClusterTree& tree, std::uint32_t index, bool in_group) {
    const Cluster& c = tree.clusters[index];
    if (!in_group && (c.count <= kGroup || c.is_leaf())) {
      group_first.push_back(cluster.size());
      group_position.push_back(c.begin);
      in_group = true;
    }
    if (c.count <= kCell || c.is_leaf()) {
      cluster.push_back(index);
      return;
    }
    for (std::uint32_t child : {c.first_child, c.first_child + 1}) add(tree, child, in_group);
  }
};

/// One side of a large block.
struct NestedEnd {
  std::size_t block = 0;
  bool is_row = true;
  std::uint32_t cluster = 0, other = 0;  ///< in the tree: that of this side and of the other side
  std::size_t first_cell = 0, last_cell = 0;  ///< range of cells [first, last)
  double multiplicity = 1;
  /// Whether light goes to the other side, or comes from there.
  bool sends = false, receives = false;
  /// [rank][rank]: an error E of the basis is an error of the block. Its square is the trace of E
  /// weighted E^T, or of E plain E^T where light at the other side has no weight.
  MatrixXd weighted = {}, plain = {};
  RowMajor transfer_matrix = {};  ///< [rank][cluster coefficients], replaces the basis
  MatrixXd folded = {};  ///< [rank][old vectors], factor that goes into the coupling matrix

  Index rank() const { return plain.rows(); }
};

/// The sides of a block; null where a side has its own basis.
struct NestedSides {
  const NestedEnd *row = nullptr, *column = nullptr;
};

/// The cluster basis of a cell, shared by all large blocks over it.
struct CellBasis {
  std::vector<std::size_t> ends;  ///< sides of blocks over the cell
  bool weighed = false;           ///< whether light from here counts
  VectorXd energies;              ///< of the directions, descending
  MatrixXd directions;            ///< [positions][positions], cut to [positions][rank]
  Index stacked = 0, rank = 0;    ///< vectors of all blocks together; of the basis
  Index first_coefficient = 0;
  MatrixXd vectors;  ///< [positions][rank], columns of norm 1
  /// [rank] norms of the vectors before scaling; divisors of the coefficients.
  VectorXd norm, length;
  Index residual_rank = 0;
};

class Nesting {
 public:
  Nesting(const Storage& storage, const NestingFrame& frame)
      : storage_(storage), frame_(frame), tree_(frame.tree), cells_(frame.tree) {
    std::uint64_t begin = 0;
    for (const TransferBlock& block : storage_.blocks) {
      values_of_.push_back(begin);
      begin += block.value_count(storage_.matrix_count);
    }
    find_ends();
  }

  /// Finds the bases; true if they reduce error and size together.
  bool pays() {
    if (ends_.empty()) return false;
    parallel_loop(ends_.size(), [&](std::size_t e) { weigh(ends_[e]); });
    bases_.resize(cells_.cluster.size());
    for (std::size_t e = 0; e < ends_.size(); ++e) {
      for (std::size_t c = ends_[e].first_cell; c < ends_[e].last_cell; ++c) {
        bases_[c].ends.push_back(e);
      }
    }
    parallel_loop(bases_.size(), [&](std::size_t c) { find_directions(c); });
    fill_groups();
    double gain = 0;
    for (std::size_t c = 0; c < bases_.size(); ++c) gain += gain_of(c);
    return gain > 0;
  }

  Storage nested() {
    parallel_loop(bases_.size(), [&](std::size_t c) { make_basis(c); });
    parallel_loop(ends_.size(), [&](std::size_t e) { find_coefficients(ends_[e]); });
    for (NestedEnd& end : ends_) fold(end);
    fit_couplings();
    parallel_loop(bases_.size(), [&](std::size_t c) { find_residual_ranks(c); });
    return assemble();
  }

 private:
  using Vectors = Eigen::Map<const RowMajor>;

  const Cluster& cell(std::size_t c) const { return tree_.clusters[cells_.cluster[c]]; }
  const ClusterWeight& weight_of_cell(std::size_t c) const {
    return frame_.weights[cells_.cluster[c]];
  }
  double multiplier() const { return frame_.cost.multiplier; }

  /// The basis of one side of a block, [rank][positions].
  Vectors basis(std::size_t b, bool is_row) const {
    const TransferBlock& block = storage_.blocks[b];
    const float* const rows = storage_.values_f32.data() + values_of_[b];
    if (is_row || block.on_diagonal()) return {rows, block.row_rank, block.row_count};
    return {rows + std::size_t{block.row_rank} * block.row_count, block.column_rank,
            block.column_count};
  }

  /// The coupling matrix of a block for one matrix, [row rank][column rank].
  Vectors coupling(std::size_t b, std::uint32_t matrix) const {
    const TransferBlock& block = storage_.blocks[b];
    const Index size = Index{block.row_rank} * block.column_rank;
    const float* const end =
        storage_.values_f32.data() + values_of_[b] + block.value_count(storage_.matrix_count);
    return {end - (storage_.matrix_count - matrix) * size, block.row_rank, block.column_rank};
  }

  void find_ends() {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> cluster_at;
    for (std::uint32_t c = 0; c < tree_.clusters.size(); ++c) {
      cluster_at[{tree_.clusters[c].begin, tree_.clusters[c].count}] = c;
    }
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      const TransferBlock& block = storage_.blocks[b];
      if (block.kind != TransferBlock::Kind::kLowRank) continue;
      if (block.row_rank == 0 || block.column_rank == 0) continue;
      const std::uint32_t row = cluster_at.at({block.row_begin, block.row_count});
      const std::uint32_t column = cluster_at.at({block.column_begin, block.column_count});
      add_end(b, true, row, column);
      if (!block.on_diagonal()) add_end(b, false, column, row);
    }
  }

  void add_end(std::size_t b, bool is_row, std::uint32_t cluster, std::uint32_t other) {
    const Cluster& range = tree_.clusters[cluster];
    const auto& begins = cells_.group_position;
    const auto first = std::ranges::lower_bound(begins, range.begin);
    const auto last = std::ranges::lower_bound(begins, range.begin + range.count);
    if (first == last || *first != range.begin || *last != range.begin + range.count) return;
    NestedEnd end{.block = b, .is_row = is_row, .cluster = cluster, .other = other};
    end.first_cell = cells_.group_first[static_cast<std::size_t>(first - begins.begin())];
    end.last_cell = cells_.group_first[static_cast<std::size_t>(last - begins.begin())];
    end.sends = frame_.wanted.leads(cluster, other);
    end.receives = frame_.wanted.leads(other, cluster);
    end.multiplicity = cluster != other && end.sends && end.receives ? 2 : 1;
    ends_.push_back(std::move(end));
  }

  void weigh(NestedEnd& end) const {
    MatrixXd other = basis(end.block, !end.is_row).transpose().cast<double>();
    if (end.receives) frame_.weights[end.other].weigh_rows(other);
    const MatrixXd gram = other.transpose() * other;
    for (std::uint32_t m = 0; m < storage_.matrix_count; ++m) {
      MatrixXd s = coupling(end.block, m).cast<double>();
      if (!end.is_row) s.transposeInPlace();
      if (m == 0) end.weighted = end.plain = MatrixXd::Zero(s.rows(), s.rows());
      end.weighted += s * gram * s.transpose();
      end.plain += s * s.transpose();
    }
  }

  /// The part of the basis of a block over a cell, [positions][rank], under the weight of light
  /// from there.
  MatrixXd weighted_part(const NestedEnd& end, std::size_t c) const {
    const Cluster& range = cell(c);
    const Index first = range.begin - tree_.clusters[end.cluster].begin;
    MatrixXd part =
        basis(end.block, end.is_row).middleCols(first, range.count).transpose().cast<double>();
    if (bases_[c].weighed) weight_of_cell(c).weigh_rows(part);
    return part;
  }

  void find_directions(std::size_t c) {
    CellBasis& own = bases_[c];
    for (const std::size_t e : own.ends) {
      own.stacked += ends_[e].rank();
      own.weighed |= ends_[e].sends;
    }
    const Index size = cell(c).count;
    MatrixXd gram = MatrixXd::Zero(size, size);
    for (const std::size_t e : own.ends) {
      const MatrixXd part = weighted_part(ends_[e], c);
      gram.noalias() += ends_[e].multiplicity * (part * ends_[e].weighted) * part.transpose();
    }
    const Eigenvectors found = eigenvectors(gram);
    own.directions = found.vectors.rowwise().reverse();
    own.energies = found.values.reverse().cwiseMax(0);
    const double worth = multiplier() * frame_.cost.size(size + own.stacked, 1, 0);
    own.rank = (own.energies.array() > worth).count();
  }

  /// Groups begin at multiples of the alignment, and so do their cluster coefficients. The ranks of
  /// their cells are filled up with the best remaining directions.
  void fill_groups() {
    for (std::size_t g = 0; g + 1 < cells_.group_first.size(); ++g) {
      const std::span group = std::span(bases_).subspan(
          cells_.group_first[g], cells_.group_first[g + 1] - cells_.group_first[g]);
      Index total = 0;
      for (const CellBasis& own : group) total += own.rank;
      if (group.front().ends.empty()) continue;
      while (total == 0 || total % kAlignment != 0) {
        const auto next = [](const CellBasis& own) {
          return own.rank < own.energies.size() ? own.energies[own.rank] : -1;
        };
        ++std::ranges::max_element(group, {}, next)->rank;
        ++total;
      }
    }
    Index coefficient = 0;
    for (CellBasis& own : bases_) {
      own.first_coefficient = coefficient;
      coefficient += own.rank;
    }
  }

  double gain_of(std::size_t c) const {
    const CellBasis& own = bases_[c];
    const auto size = static_cast<Index>(cell(c).count);
    const double before = frame_.cost.size(size * own.stacked, 0, 0);
    const double after = frame_.cost.size((size + own.stacked) * own.rank, own.rank, 0) +
                         (own.rank > 0 ? kCellOverhead : 0);
    return multiplier() * (before - after) - own.energies.tail(size - own.rank).sum();
  }

  /// Scales the vectors to norm 1. The lengths of cluster coefficients lie between equal ones and
  /// their energies: this is where rounding does least (lab/035).
  void make_basis(std::size_t c) {
    CellBasis& own = bases_[c];
    own.directions.conservativeResize(Eigen::NoChange, own.rank);
    own.vectors = own.directions;
    if (own.weighed) weight_of_cell(c).unweigh_rows(own.vectors);
    own.norm = own.vectors.colwise().norm();
    for (Index k = 0; k < own.rank; ++k) own.vectors.col(k) /= own.norm[k];
    constexpr double kLeast = 1e-3;
    const double most = own.rank > 0 ? own.energies[0] : 1;
    own.length =
        (own.energies.head(own.rank) / std::max(most, 1e-300)).array().pow(0.125).max(kLeast);
  }

  void find_coefficients(NestedEnd& end) {
    const CellBasis &first = bases_[end.first_cell], &last = bases_[end.last_cell - 1];
    end.transfer_matrix.resize(end.rank(),
                               last.first_coefficient + last.rank - first.first_coefficient);
    for (std::size_t c = end.first_cell; c < end.last_cell; ++c) {
      const CellBasis& own = bases_[c];
      const MatrixXd coefficients = own.directions.transpose() * weighted_part(end, c);
      end.transfer_matrix.middleCols(own.first_coefficient - first.first_coefficient, own.rank) =
          (own.length.cwiseInverse().asDiagonal() * coefficients).transpose().cast<float>();
    }
  }

  /// Scales the rows of the transfer matrix to norm 1, as vectors of bases, and moves the norms
  /// into the coupling matrices. A side with more vectors than cluster coefficients keeps as many
  /// vectors as coefficients; the rest goes into the coupling matrix.
  static void fold(NestedEnd& end) {
    if (end.rank() > end.transfer_matrix.cols()) {
      const MatrixXd vectors = end.transfer_matrix.transpose().cast<double>();
      const Eigen::HouseholderQR<MatrixXd> qr(vectors);
      end.folded = qr.matrixQR().triangularView<Eigen::Upper>();
      end.transfer_matrix = MatrixXd(qr.householderQ()).transpose().cast<float>();
    } else {
      const VectorXd norm = end.transfer_matrix.rowwise().norm().cast<double>();
      end.folded = (norm.array() > 0).select(norm, 1).asDiagonal();
      end.transfer_matrix.rowwise().normalize();
      for (Index r = 0; r < norm.size(); ++r) {
        if (!(norm[r] > 0)) end.transfer_matrix.row(r).setZero();
      }
    }
    scale_errors(end, end.folded);
  }

  static void scale_errors(NestedEnd& end, const MatrixXd& by) {
    end.weighted = by * end.weighted * by.transpose();
    end.plain = by * end.plain * by.transpose();
  }

  /// Makes cluster coefficients longer, and coupling matrices smaller, until the largest entry of
  /// all coupling matrices fits half precision. All get the same factor, so that small coupling
  /// matrices do not fall below its normal numbers.
  void fit_couplings() {
    double one_side = 0, both_sides = 0;
    for (const auto& [b, sides] : sides_of_blocks()) {
      double& largest = sides.row != nullptr && sides.column != nullptr ? both_sides : one_side;
      for (std::uint32_t m = 0; m < storage_.matrix_count; ++m) {
        largest = std::max<double>(largest, folded_coupling(b, m, sides).cwiseAbs().maxCoeff());
      }
    }
    const double length =
        std::max(one_side / kLargestCoupling, std::sqrt(both_sides / kLargestCoupling));
    if (length == 0) return;
    for (NestedEnd& end : ends_) {
      end.folded /= length;
      end.weighted /= length * length;
      end.plain /= length * length;
    }
    for (CellBasis& own : bases_) own.length *= length;
  }

  /// The sides of all blocks that have any; a block on the diagonal has the same side twice.
  std::map<std::size_t, NestedSides> sides_of_blocks() const {
    std::map<std::size_t, NestedSides> sides;
    for (const NestedEnd& end : ends_) {
      NestedSides& of_block = sides[end.block];
      if (end.is_row) of_block.row = &end;
      if (!end.is_row || storage_.blocks[end.block].on_diagonal()) of_block.column = &end;
    }
    return sides;
  }

  /// A coupling matrix times the factors that its sides fold into it.
  MatrixXd folded_coupling(std::size_t b, std::uint32_t matrix, const NestedSides& sides) const {
    MatrixXd s = coupling(b, matrix).cast<double>();
    if (sides.row != nullptr) s = sides.row->folded * s;
    if (sides.column != nullptr) s *= sides.column->folded.transpose();
    return s;
  }

  void find_residual_ranks(std::size_t c) {
    CellBasis& own = bases_[c];
    VectorXd arriving = VectorXd::Zero(own.rank), leaving = arriving;
    for (const std::size_t e : own.ends) {
      const NestedEnd& end = ends_[e];
      const Index first = own.first_coefficient - bases_[end.first_cell].first_coefficient;
      const MatrixXd t = own.length.asDiagonal() *
                         end.transfer_matrix.middleCols(first, own.rank).transpose().cast<double>();
      if (end.receives) arriving += (t * end.weighted).cwiseProduct(t).rowwise().sum();
      if (end.sends) leaving += (t * end.plain).cwiseProduct(t).rowwise().sum();
    }
    const double size = cell(c).count, weight = weight_of_cell(c).squared_norm();
    own.residual_rank = worthwhile_residual_rank(own.vectors, multiplier(), [&](Index k) {
      return own.norm[k] * own.norm[k] * (size * arriving[k] + weight * leaving[k]);
    });
  }

  /// The residual rank of the transfer matrix of a side.
  Index residual_rank(const NestedEnd& end) const {
    double arriving = 0, leaving = 0;
    for (std::size_t c = end.first_cell; c < end.last_cell; ++c) {
      const CellBasis& own = bases_[c];
      if (end.receives) arriving += own.norm.cwiseProduct(own.length).squaredNorm();
      if (end.sends) leaving += own.length.squaredNorm();
    }
    return worthwhile_residual_rank(
        end.transfer_matrix.transpose().cast<double>(), multiplier(),
        [&](Index r) { return arriving * end.weighted(r, r) + leaving * end.plain(r, r); });
  }

  Storage assemble() const {
    Storage result = storage_;
    result.blocks.clear();
    std::vector<float> values;
    const auto positions =
        static_cast<std::uint32_t>(HierarchicalFormat::position_count(tree_.patch.size()));
    add_coefficients(positions, result, values);
    const std::map<std::size_t, NestedSides> sides = sides_of_blocks();
    for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
      const auto found = sides.find(b);
      if (found == sides.end()) {
        const float* const from = storage_.values_f32.data() + values_of_[b];
        result.blocks.push_back(storage_.blocks[b]);
        values.insert(values.end(), from,
                      from + storage_.blocks[b].value_count(storage_.matrix_count));
      } else {
        add_block(b, found->second, positions, result, values);
      }
    }
    values.resize(values.size() + HierarchicalFormat::kPadding, 0.0F);
    result.values_f32 = SharedArray(std::move(values));
    return result;
  }

  void add_coefficients(std::uint32_t positions, Storage& result,
                        std::vector<float>& values) const {
    for (std::size_t c = 0; c < bases_.size(); ++c) {
      const CellBasis& own = bases_[c];
      if (own.rank == 0) continue;
      const auto rank = static_cast<std::uint32_t>(own.rank);
      result.blocks.push_back(
          {.row_begin = cell(c).begin,
           .row_count = cell(c).count,
           .column_begin = positions + static_cast<std::uint32_t>(own.first_coefficient),
           .column_count = rank,
           .kind = TransferBlock::Kind::kClusterBasis,
           .row_rank = rank,
           .row_residual_rank = static_cast<std::uint32_t>(own.residual_rank)});
      for (Index k = 0; k < own.vectors.size(); ++k) {
        values.push_back(static_cast<float>(own.vectors.data()[k]));
      }
      for (Index k = 0; k < own.rank; ++k) {
        result.coefficient_scale.push_back(static_cast<float>(own.norm[k] * own.length[k]));
      }
    }
  }

  /// One side of a block in the result.
  struct Side {
    std::uint32_t begin, count, rank, residual_rank;
    RowMajor vectors;
  };

  Side side_of(std::size_t b, bool is_row, const NestedEnd* end, std::uint32_t positions) const {
    const TransferBlock& block = storage_.blocks[b];
    const std::uint32_t rank = is_row ? block.row_rank : block.column_rank;
    if (end != nullptr) {
      const Index first = bases_[end->first_cell].first_coefficient;
      return {positions + static_cast<std::uint32_t>(first),
              static_cast<std::uint32_t>(end->transfer_matrix.cols()),
              static_cast<std::uint32_t>(end->rank()),
              static_cast<std::uint32_t>(residual_rank(*end)), end->transfer_matrix};
    }
    if (is_row) {
      return {block.row_begin, block.row_count, rank, block.row_residual_rank, basis(b, true)};
    }
    return {block.column_begin, block.column_count, rank, block.column_residual_rank,
            basis(b, false)};
  }

  /// Rows come after columns; the sides are swapped if only the columns have cluster bases.
  void add_block(std::size_t b, const NestedSides& sides, std::uint32_t positions, Storage& result,
                 std::vector<float>& values) const {
    const bool diagonal = storage_.blocks[b].on_diagonal();
    Side row = side_of(b, true, sides.row, positions);
    Side column = diagonal ? row : side_of(b, false, sides.column, positions);
    const bool swapped = row.begin < column.begin;
    if (swapped) std::swap(row, column);
    result.blocks.push_back({.row_begin = row.begin,
                             .row_count = row.count,
                             .column_begin = column.begin,
                             .column_count = column.count,
                             .kind = TransferBlock::Kind::kLowRank,
                             .row_rank = row.rank,
                             .column_rank = column.rank,
                             .row_residual_rank = row.residual_rank,
                             .column_residual_rank = column.residual_rank,
                             .coupling_step = storage_.blocks[b].coupling_step});
    const auto add = [&](const RowMajor& matrix) {
      values.insert(values.end(), matrix.data(), matrix.data() + matrix.size());
    };
    add(row.vectors);
    if (!diagonal) add(column.vectors);
    for (std::uint32_t m = 0; m < storage_.matrix_count; ++m) {
      RowMajor s = folded_coupling(b, m, sides).cast<float>();
      if (swapped) s.transposeInPlace();
      add(s);
    }
  }

  const Storage& storage_;
  const NestingFrame& frame_;
  const ClusterTree& tree_;
  Cells cells_;
  std::vector<std::uint64_t> values_of_;  ///< first value of each block
  std::vector<NestedEnd> ends_;
  std::vector<CellBasis> bases_;  ///< by cell
};

}  // namespace

Storage nest_bases(Storage storage, const NestingFrame& frame) {
  load_blas();
  Nesting nesting(storage, frame);
  if (nesting.pays()) return nesting.nested();
  return storage;
}

}  // namespace rebounce

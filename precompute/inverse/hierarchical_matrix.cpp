#include "precompute/inverse/hierarchical_matrix.h"

#include <algorithm>

#include "precompute/base/blas.h"
#include "rebounce/error.h"
#include "transfer/format/hierarchical_values.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Vectors = HierarchicalMatrix::Vectors;
using ConstMap = Eigen::Map<const Vectors>;

// Positions in a strip. Each strip lists the blocks that meet it.
constexpr std::uint32_t kStrip = 512;

// Vectors that one thread multiplies with at a time.
constexpr Index kBatchVectors = 32;

/// Computes to = matrix from, or to += matrix from with kAdd. matrix is [rows][columns], the
/// vectors have `width` columns; all are row-major.
enum class Write { kSet, kAdd };
void product(bool transposed, Index rows, Index columns, const float* matrix, const float* from,
             float* to, Index width, Write write) {
  // The BLAS expects column-major matrices: these are the transposed ones.
  const auto m = static_cast<int>(width), n = static_cast<int>(rows), k = static_cast<int>(columns),
             stride = transposed ? n : k;
  const float one = 1, kept = write == Write::kAdd ? 1 : 0;
  sgemm_("N", transposed ? "T" : "N", &m, &n, &k, &one, from, &m, matrix, &stride, &kept, to, &m);
}

/// Counts the positions before each at which any vector is not 0, [positions + 1].
void find_lit(const Vectors& x, std::vector<std::uint32_t>& lit_before) {
  lit_before.resize(static_cast<std::size_t>(x.rows()) + 1);
  lit_before[0] = 0;
  for (Index i = 0; i < x.rows(); ++i) {
    const bool lit = std::any_of(x.row(i).data(), x.row(i).data() + x.cols(),
                                 [](float value) { return value != 0; });
    lit_before[i + 1] = lit_before[i] + (lit ? 1 : 0);
  }
}

/// Makes room for `rows`. Matrices of several sizes share a workspace, so rows are never given
/// back.
void grow(Vectors& vectors, Index rows, Index width) {
  if (vectors.rows() < rows || vectors.cols() != width) vectors.resize(rows, width);
}

}  // namespace

struct HierarchicalMatrix::Places {
  std::vector<Place> place;  ///< by position

  Places(std::span<const std::uint32_t> patches, std::span<const std::uint32_t> position) {
    place.reserve(patches.size());
    for (std::uint32_t k = 0; k < patches.size(); ++k) place.push_back({position[patches[k]], k});
    std::ranges::sort(place, {}, &Place::position);
  }

  std::span<const Place> within(std::uint32_t begin, std::uint32_t count) const {
    const auto first = std::ranges::lower_bound(place, begin, {}, &Place::position);
    const auto last =
        std::ranges::lower_bound(first, place.end(), begin + count, {}, &Place::position);
    return {first, last};
  }
};

HierarchicalMatrix::HierarchicalMatrix(const HierarchicalStorage& storage,
                                       std::vector<std::uint8_t> group)
    : SymmetricMatrix({}, std::move(group)),
      storage_(decode(storage)),
      layout_(storage_),
      position_(storage_.patch.size()) {
  if (layout_.cluster_coefficient_count > 0)
    throw Error("hierarchical matrix: blocks with cluster bases are not supported");
  const SharedArray<float> values = std::exchange(storage_.values_f32, {});
  bases_.assign(values.begin(), values.begin() + layout_.basis_value_count);
  const std::uint64_t count = layout_.coupling_value_count / matrix_count();
  const float* const couplings = values.data() + layout_.basis_value_count;
  for (std::uint32_t m = 0; m < matrix_count(); ++m) {
    std::vector<float>& own = couplings_.emplace_back(count);
    for (std::uint64_t k = 0; k < count; ++k) own[k] = couplings[k * matrix_count() + m];
  }
  for (std::uint32_t k = 0; k < position_.size(); ++k) position_[storage_.patch[k]] = k;
  for (const HierarchicalLayout::Cluster& cluster : layout_.clusters) {
    low_rank_count_ = std::max<Index>(low_rank_count_, Index{cluster.coefficient} + cluster.rank);
  }
  if (!storage_.scale_exponent.empty()) fold_scales();
  sort_blocks();
}

/// Passes on R K R instead of K. R holds powers of two, so nothing is rounded.
void HierarchicalMatrix::fold_scales() {
  std::vector<float> scale(static_cast<std::size_t>(position_count()), 1.0F);
  for (std::size_t k = 0; k < position_.size(); ++k) scale[k] = storage_.position_scale(k);
  storage_.scale_exponent.clear();
  const auto at = [&](std::uint32_t begin, std::uint32_t count) {
    return Eigen::Map<const Eigen::VectorXf>(scale.data() + begin, count).asDiagonal();
  };
  for (const HierarchicalLayout::Cluster& cluster : layout_.clusters) {
    Eigen::Map<Vectors> bases(bases_.data() + cluster.values, cluster.rank, cluster.size);
    bases = (bases * at(cluster.begin, cluster.size)).eval();
  }
  for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
    const TransferBlock& block = storage_.blocks[b];
    if (block.kind != TransferBlock::Kind::kDense) continue;
    const std::uint64_t begin = layout_.block_layouts[b].values / matrix_count();
    for (std::vector<float>& own : couplings_) {
      Eigen::Map<Vectors> entries(own.data() + begin, block.row_count, block.column_count);
      entries = (at(block.row_begin, block.row_count) * entries *
                 at(block.column_begin, block.column_count))
                    .eval();
    }
  }
}

Index HierarchicalMatrix::position_count() const {
  return static_cast<Index>(HierarchicalFormat::position_count(storage_.patch.size()));
}

void HierarchicalMatrix::sort_blocks() {
  touching_.resize((static_cast<std::size_t>(position_count()) + kStrip - 1) / kStrip);
  for (std::uint32_t b = 0; b < storage_.blocks.size(); ++b) {
    const TransferBlock& block = storage_.blocks[b];
    if (!has_values(block)) continue;
    const std::uint32_t row_end = (block.row_begin + block.row_count - 1) / kStrip;
    const std::uint32_t column_end = (block.column_begin + block.column_count - 1) / kStrip;
    for (std::uint32_t s = block.column_begin / kStrip; s <= column_end; ++s) {
      touching_[s].push_back(b);
    }
    if (block.on_diagonal()) continue;
    for (std::uint32_t s = std::max(block.row_begin / kStrip, column_end + 1); s <= row_end; ++s) {
      touching_[s].push_back(b);
    }
  }
}

std::vector<std::uint32_t> HierarchicalMatrix::blocks_near(const Places& places) const {
  std::vector<std::uint32_t> blocks;
  std::uint32_t before = kNone;
  for (const auto& place : places.place) {
    const std::uint32_t strip = place.position / kStrip;
    if (strip == std::exchange(before, strip)) continue;
    blocks.insert(blocks.end(), touching_[strip].begin(), touching_[strip].end());
  }
  std::ranges::sort(blocks);
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

const float* HierarchicalMatrix::basis(const HierarchicalLayout::End& end) const {
  return bases_.data() + layout_.basis_index(end, 0, 0);
}

const float* HierarchicalMatrix::coupling(std::uint32_t matrix, std::size_t block) const {
  return couplings_[matrix].data() + layout_.block_layouts[block].values / matrix_count();
}

struct HierarchicalMatrix::Side {
  Index begin, count;         ///< positions
  Index first, size;          ///< rows of the vectors that a product reads or writes
  std::uint32_t cluster = 0;  ///< of a low-rank block
};

HierarchicalMatrix::Side HierarchicalMatrix::side_of(const TransferBlock& block, std::size_t index,
                                                     bool row) const {
  const Index begin = row ? block.row_begin : block.column_begin;
  const Index count = row ? block.row_count : block.column_count;
  if (block.kind == TransferBlock::Kind::kDense) return {begin, count, begin, count};
  const HierarchicalLayout::BlockLayout& block_layout = layout_.block_layouts[index];
  const HierarchicalLayout::End& end = row ? block_layout.row : block_layout.column;
  return {begin, count, end.coefficient, row ? block.row_rank : block.column_rank, end.cluster};
}

struct HierarchicalMatrix::Part {
  std::size_t block;
  std::span<const Place> rows, columns;  ///< in the order of the block
  bool mirrored;                         ///< whether rows of the block are columns of the entries
};

/// The parts of blocks that two lists of patches meet.
std::vector<HierarchicalMatrix::Part> HierarchicalMatrix::parts_between(
    const Places& rows, const Places& columns) const {
  std::vector<Part> parts;
  const auto add = [&](std::uint32_t b, const Places& at_rows, const Places& at_columns,
                       bool mirrored) {
    const TransferBlock& block = storage_.blocks[b];
    const Part part{b, at_rows.within(block.row_begin, block.row_count),
                    at_columns.within(block.column_begin, block.column_count), mirrored};
    if (!part.rows.empty() && !part.columns.empty()) parts.push_back(part);
  };
  for (const std::uint32_t b : blocks_near(columns)) {
    add(b, rows, columns, false);
    if (!storage_.blocks[b].on_diagonal()) add(b, columns, rows, true);
  }
  return parts;
}

void HierarchicalMatrix::entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                                 std::span<const std::uint32_t> columns,
                                 Eigen::Ref<MatrixXf> entries) const {
  entries.setZero();
  const Places at_rows(rows, position_), at_columns(columns, position_);
  for (const Part& part : parts_between(at_rows, at_columns)) {
    const MatrixXf values = part_entries(matrix, part);
    for (std::size_t j = 0; j < part.columns.size(); ++j) {
      for (std::size_t i = 0; i < part.rows.size(); ++i) {
        const Index r = part.rows[i].index, c = part.columns[j].index;
        (part.mirrored ? entries(c, r) : entries(r, c)) =
            values(static_cast<Index>(i), static_cast<Index>(j));
      }
    }
  }
}

/// Rows [rank][places] of the basis of a side of a block.
Vectors HierarchicalMatrix::basis_at(const HierarchicalLayout::End& end, const Side& side,
                                     std::span<const Place> places) const {
  const ConstMap whole(basis(end), side.size, side.count);
  Vectors part(side.size, static_cast<Index>(places.size()));
  for (Index k = 0; k < part.cols(); ++k) part.col(k) = whole.col(places[k].position - side.begin);
  return part;
}

/// The factors of a part of a block of low rank, [rank of the rows][places] each.
std::pair<Vectors, Vectors> HierarchicalMatrix::part_factors(std::uint32_t matrix,
                                                             const Part& part) const {
  const HierarchicalLayout::BlockLayout& layout = layout_.block_layouts[part.block];
  const TransferBlock& block = storage_.blocks[part.block];
  const Vectors v = basis_at(layout.column, side_of(block, part.block, false), part.columns);
  return {basis_at(layout.row, side_of(block, part.block, true), part.rows),
          ConstMap(coupling(matrix, part.block), block.row_rank, block.column_rank) * v};
}

MatrixXf HierarchicalMatrix::part_entries(std::uint32_t matrix, const Part& part) const {
  const TransferBlock& block = storage_.blocks[part.block];
  MatrixXf entries(part.rows.size(), part.columns.size());
  if (block.kind != TransferBlock::Kind::kDense) {
    const auto [of_rows, of_columns] = part_factors(matrix, part);
    entries.noalias() = of_rows.transpose() * of_columns;
    return entries;
  }
  const ConstMap whole(coupling(matrix, part.block), block.row_count, block.column_count);
  for (Index j = 0; j < entries.cols(); ++j) {
    for (Index i = 0; i < entries.rows(); ++i) {
      entries(i, j) = whole(part.rows[i].position - block.row_begin,
                            part.columns[j].position - block.column_begin);
    }
  }
  return entries;
}

EntryPart HierarchicalMatrix::entry_part(std::uint32_t matrix, const Part& part) const {
  const auto indices = [](std::span<const Place> places) {
    std::vector<std::uint32_t> list;
    for (const Place& place : places) list.push_back(place.index);
    return list;
  };
  const TransferBlock& block = storage_.blocks[part.block];
  EntryPart result{indices(part.rows), indices(part.columns), {}, {}};
  const std::size_t of_product = (part.rows.size() + part.columns.size()) * block.row_rank;
  if (block.kind == TransferBlock::Kind::kDense ||
      of_product >= part.rows.size() * part.columns.size()) {
    result.left = part_entries(matrix, part);
    if (part.mirrored) result.left.transposeInPlace();
  } else {
    const auto [of_rows, of_columns] = part_factors(matrix, part);
    result.left = of_rows.transpose();
    result.right = of_columns.transpose();
    if (part.mirrored) std::swap(result.left, result.right);
  }
  if (part.mirrored) std::swap(result.rows, result.columns);
  return result;
}

std::optional<JointEntryParts> HierarchicalMatrix::parts(
    std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns) const {
  const Places at_rows(rows, position_), at_columns(columns, position_);
  JointEntryParts all;
  all.own.resize(matrix_count());
  Index values = 0;  // of all matrices
  for (const Part& part : parts_between(at_rows, at_columns)) {
    for (std::uint32_t m = 0; m < matrix_count(); ++m) {
      EntryPart entries = entry_part(m, part);
      if (entries.left.isZero(0)) continue;
      values += entries.value_count();
      all.own[m].push_back(std::move(entries));
    }
    if (!are_few(values / matrix_count(), rows.size(), columns.size())) return std::nullopt;
  }
  return all;
}

void HierarchicalMatrix::multiply(std::uint32_t matrix, const Vectors& x, Vectors& y,
                                  Workspace& workspace) const {
  const Index width = x.cols();
  grow(workspace.sent, low_rank_count_, width);
  grow(workspace.received, low_rank_count_, width);
  find_lit(x, workspace.lit_before);
  y.setZero(x.rows(), width);
  for (const HierarchicalLayout::Cluster& cluster : layout_.clusters) {
    if (!workspace.is_lit(cluster.begin, cluster.size)) continue;
    product(false, cluster.rank, cluster.size, bases_.data() + cluster.values,
            x.row(cluster.begin).data(), workspace.sent.row(cluster.coefficient).data(), width,
            Write::kSet);
  }
  multiply_blocks(matrix, x, y, workspace);
  for (std::size_t c = 0; c < layout_.clusters.size(); ++c) {
    if (workspace.reached[c] == 0) continue;
    const HierarchicalLayout::Cluster& cluster = layout_.clusters[c];
    product(true, cluster.size, cluster.rank, bases_.data() + cluster.values,
            workspace.received.row(cluster.coefficient).data(), y.row(cluster.begin).data(), width,
            Write::kAdd);
  }
}

/// Finds the clusters that a coupling matrix brings light to.
void HierarchicalMatrix::find_reached(Workspace& workspace) const {
  workspace.reached.assign(layout_.clusters.size(), 0);
  for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
    const TransferBlock& block = storage_.blocks[b];
    if (block.kind == TransferBlock::Kind::kDense || !has_values(block)) continue;
    const auto pass = [&](const Side& source, const Side& target) {
      if (workspace.is_lit(source.begin, source.count)) workspace.reached[target.cluster] = 1;
    };
    const Side row = side_of(block, b, true), column = side_of(block, b, false);
    pass(column, row);
    if (!block.on_diagonal()) pass(row, column);
  }
}

/// Multiplies with the coupling matrices, and with all of the dense blocks.
void HierarchicalMatrix::multiply_blocks(std::uint32_t matrix, const Vectors& x, Vectors& y,
                                         Workspace& workspace) const {
  find_reached(workspace);
  for (std::size_t b = 0; b < storage_.blocks.size(); ++b) {
    const TransferBlock& block = storage_.blocks[b];
    if (!has_values(block)) continue;
    const bool dense = block.kind == TransferBlock::Kind::kDense;
    const Vectors& from = dense ? x : workspace.sent;
    Vectors& to = dense ? y : workspace.received;
    const float* const entries = coupling(matrix, b);
    const Side row = side_of(block, b, true), column = side_of(block, b, false);
    // A coefficient is written by one block, a position by several.
    const auto pass = [&](const Side& source, const Side& target, bool transposed) {
      if (workspace.is_lit(source.begin, source.count)) {
        product(transposed, target.size, source.size, entries, from.row(source.first).data(),
                to.row(target.first).data(), x.cols(), dense ? Write::kAdd : Write::kSet);
      } else if (!dense && workspace.reached[target.cluster] != 0) {
        to.middleRows(target.first, target.size).setZero();
      }
    };
    pass(column, row, false);
    if (!block.on_diagonal()) pass(row, column, true);
  }
}

MatrixXf HierarchicalMatrix::multiply(std::uint32_t matrix, const MatrixXf& x) const {
  load_blas();
  MatrixXf result(x.rows(), x.cols());
#pragma omp parallel for schedule(dynamic, 1)
  for (Index begin = 0; begin < x.cols(); begin += kBatchVectors) {
    const Index width = std::min(kBatchVectors, x.cols() - begin);
    Vectors in = Vectors::Zero(position_count(), width), out;
    for (std::size_t k = 0; k < position_.size(); ++k) {
      in.row(static_cast<Index>(k)) = x.row(storage_.patch[k]).segment(begin, width);
    }
    Workspace workspace;
    multiply(matrix, in, out, workspace);
    for (std::size_t k = 0; k < position_.size(); ++k) {
      result.row(storage_.patch[k]).segment(begin, width) = out.row(static_cast<Index>(k));
    }
  }
  return result;
}

}  // namespace rebounce

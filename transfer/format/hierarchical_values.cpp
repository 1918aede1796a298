#include "transfer/format/hierarchical_values.h"

#include <algorithm>
#include <utility>

#include "transfer/format/hierarchical_encoding.h"
#include "transfer/format/row_format.h"
#include "transfer/format/stored_values.h"

namespace rebounce {
namespace {

using Storage = HierarchicalStorage;

/// Reads stored values of any precision as real numbers.
class ValueReader {
 public:
  ValueReader(const Storage& storage, const HierarchicalLayout& layout)
      : storage_(storage),
        layout_(layout),
        first_coupling_(storage.first_coupling(layout.basis_value_count)) {}

  /// Entry `position` of vector `vector` of the basis at `end`, residual included; `rank`: the rank
  /// of that end.
  double basis(const HierarchicalLayout::End& end, std::uint64_t rank, std::uint64_t vector,
               std::uint64_t position) const {
    const double value = stored_basis(layout_.basis_index(end, vector, position));
    if (vector >= end.residual_rank) return value;
    return value + stored_basis(layout_.basis_index(end, rank + vector, position)) /
                       double{HierarchicalFormat::kResidualScale};
  }
  /// Entry `index` of a dense block.
  double dense(const HierarchicalLayout::BlockLayout& block, std::uint64_t index) const {
    return stored_coupling(block.values + index);
  }
  /// An entry of the coupling matrix of a block with this layout and column rank.
  double coupling(const HierarchicalLayout::BlockLayout& block, std::uint64_t row,
                  std::uint64_t column_rank, std::uint64_t column, std::uint32_t matrix) const {
    const std::uint64_t matrices = storage_.matrix_count, row_size = column_rank * matrices;
    const std::uint64_t index = column * matrices + matrix;
    if (!storage_.has_packed_couplings())
      return stored_coupling(block.values + row * row_size + index);
    std::uint64_t begin = block.values;
    for (std::uint64_t r = 0; r < row; ++r) begin += format(block, r).row_bytes(row_size);
    const RowFormat of_row = format(block, row);
    const double integer =
        unpacked(storage_.packed_couplings.data() + begin, index * of_row.half_bytes(), of_row);
    return integer * of_row.step() / double{kCouplingScale<std::uint16_t>};
  }

  const Storage& storage() const { return storage_; }
  const HierarchicalLayout& layout() const { return layout_; }

 private:
  RowFormat format(const HierarchicalLayout::BlockLayout& block, std::uint64_t row) const {
    return {storage_.row_format[block.first_row + row]};
  }
  double stored_coupling(std::uint64_t index) const {
    return with_couplings(storage_, [&](const auto& array) {
      return coupling_value(array[first_coupling_ + index]);
    });
  }
  double stored_basis(std::uint64_t index) const {
    return with_bases(storage_, [&](const auto& array) { return basis_value(array[index]); });
  }

  const Storage& storage_;
  const HierarchicalLayout& layout_;
  std::uint64_t first_coupling_;
};

/// The entries [row_count][column_count] of one matrix, over positions or cluster coefficients.
std::vector<double> block_entries(const ValueReader& read,
                                  const HierarchicalLayout::BlockLayout& block_layout,
                                  const TransferBlock& block, std::uint32_t matrix) {
  const std::size_t rows = block.row_count, columns = block.column_count;
  const std::uint32_t matrices = read.storage().matrix_count;
  std::vector<double> entries(rows * columns, 0.0);
  if (block.kind == TransferBlock::Kind::kDense) {
    for (std::size_t k = 0; k < entries.size(); ++k) {
      entries[k] = read.dense(block_layout, k * matrices + matrix);
    }
    return entries;
  }
  const std::size_t row_rank = block.row_rank, column_rank = block.column_rank;
  std::vector<double> right(columns);  // a row of S V^T
  for (std::size_t r = 0; r < row_rank; ++r) {
    std::ranges::fill(right, 0.0);
    for (std::size_t k = 0; k < column_rank; ++k) {
      const double coupling = read.coupling(block_layout, r, column_rank, k, matrix);
      for (std::size_t j = 0; j < columns; ++j)
        right[j] += coupling * read.basis(block_layout.column, column_rank, k, j);
    }
    for (std::size_t i = 0; i < rows; ++i) {
      const double left = read.basis(block_layout.row, row_rank, r, i);
      for (std::size_t j = 0; j < columns; ++j) entries[i * columns + j] += left * right[j];
    }
  }
  return entries;
}

/// Copies the coupling matrices or the entries of a block to `to`.
void copy_couplings(const ValueReader& read, const TransferBlock& block, std::size_t index,
                    float* to) {
  const HierarchicalLayout::BlockLayout& from = read.layout().block_layouts[index];
  const std::uint32_t matrices = read.storage().matrix_count;
  if (block.kind == TransferBlock::Kind::kDense) {
    for (std::uint64_t k = 0; k < block.value_count(matrices); ++k) {
      *to++ = static_cast<float>(read.dense(from, k));
    }
  } else if (!is_cluster_basis(block)) {
    for (std::uint32_t r = 0; r < block.row_rank; ++r) {
      for (std::uint32_t c = 0; c < block.column_rank; ++c) {
        for (std::uint32_t m = 0; m < matrices; ++m) {
          *to++ = static_cast<float>(read.coupling(from, r, block.column_rank, c, m));
        }
      }
    }
  }
}

/// The transpose of `entries` [rows][columns].
std::vector<double> transposed(const std::vector<double>& entries, std::size_t columns) {
  std::vector<double> result(entries.size());
  const std::size_t rows = entries.size() / columns;
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j < columns; ++j) result[j * rows + i] = entries[i * columns + j];
  }
  return result;
}

/// A range of positions or of cluster coefficients.
struct Range {
  std::uint32_t begin, count;
};

/// Expands the rows of `entries` [rows.count][columns] from cluster coefficients to positions, and
/// appends these to `positions`. Rows that are positions already stay as they are.
std::vector<double> of_positions(const ValueReader& read, Range rows, std::size_t columns,
                                 std::vector<double> entries,
                                 std::vector<std::uint32_t>& positions) {
  const Storage& storage = read.storage();
  const std::size_t position_count = HierarchicalFormat::position_count(storage.area.size());
  if (rows.begin < position_count) {
    for (std::uint32_t k = 0; k < rows.count; ++k) positions.push_back(rows.begin + k);
    return entries;
  }
  std::vector<double> result;
  for (std::size_t b = 0; b < storage.blocks.size(); ++b) {
    const TransferBlock& basis = storage.blocks[b];
    if (!is_cluster_basis(basis) || basis.column_begin < rows.begin ||
        basis.column_begin >= rows.begin + rows.count) {
      continue;
    }
    const HierarchicalLayout::End& end = read.layout().block_layouts[b].row;
    const float* const scale =
        storage.coefficient_scale.data() + basis.column_begin - position_count;
    for (std::uint32_t k = 0; k < basis.row_count; ++k) {
      positions.push_back(basis.row_begin + k);
      std::vector<double> row(columns, 0.0);
      for (std::uint32_t m = 0; m < basis.row_rank; ++m) {
        const double weight = scale[m] * read.basis(end, basis.row_rank, m, k);
        const double* const from = entries.data() + (basis.column_begin - rows.begin + m) * columns;
        for (std::size_t c = 0; c < columns; ++c) row[c] += weight * from[c];
      }
      result.insert(result.end(), row.begin(), row.end());
    }
  }
  return result;
}

}  // namespace

Storage decode(const Storage& storage) {
  Storage streamed = stream_values(storage);
  const HierarchicalPrecision exact = hierarchical_precision(Precision::kF32);
  if (streamed.precision == exact) return streamed;
  Storage decoded = streamed;
  decoded.precision = exact;
  decoded.row_format.clear();
  for_each_array(decoded, [](auto& array) { array = {}; });
  const HierarchicalLayout from(streamed), to(decoded);
  const ValueReader read(streamed, from);
  std::vector<float> values(
      HierarchicalLayout::padded(to.basis_value_count + to.coupling_value_count));
  const auto copy_basis = [&](const HierarchicalLayout::End& source,
                              const HierarchicalLayout::End& target, std::uint32_t rank,
                              std::uint32_t size) {
    for (std::uint32_t r = 0; r < rank; ++r) {
      for (std::uint32_t k = 0; k < size; ++k) {
        values[to.basis_index(target, r, k)] = static_cast<float>(read.basis(source, rank, r, k));
      }
    }
  };
  for (std::size_t b = 0; b < streamed.blocks.size(); ++b) {
    const TransferBlock& block = streamed.blocks[b];
    if (block.kind == TransferBlock::Kind::kDense || !has_values(block)) continue;
    copy_basis(from.block_layouts[b].row, to.block_layouts[b].row, block.row_rank, block.row_count);
    if (block.on_diagonal() || is_cluster_basis(block)) continue;
    copy_basis(from.block_layouts[b].column, to.block_layouts[b].column, block.column_rank,
               block.column_count);
  }
  for (std::size_t b = 0; b < streamed.blocks.size(); ++b) {
    copy_couplings(read, streamed.blocks[b], b,
                   values.data() + to.basis_value_count + to.block_layouts[b].values);
  }
  decoded.values_f32 = SharedArray(std::move(values));
  return decoded;
}

BlockOfPositions block_of_positions(const Storage& storage, const HierarchicalLayout& layout,
                                    std::size_t index, std::uint32_t matrix) {
  const ValueReader read(storage, layout);
  const TransferBlock& block = storage.blocks[index];
  BlockOfPositions result;
  std::vector<double> entries = block_entries(read, layout.block_layouts[index], block, matrix);
  entries = of_positions(read, {block.row_begin, block.row_count}, block.column_count,
                         std::move(entries), result.rows);
  entries = transposed(entries, block.column_count);
  entries = of_positions(read, {block.column_begin, block.column_count}, result.rows.size(),
                         std::move(entries), result.columns);
  result.entries = transposed(entries, result.rows.size());
  return result;
}

}  // namespace rebounce

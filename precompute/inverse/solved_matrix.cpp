#include "precompute/inverse/solved_matrix.h"

#include <algorithm>
#include <bitset>
#include <numeric>
#include <utility>

namespace rebounce {

using Eigen::Index;
using Eigen::MatrixXf;

void SolvedMatrix::set_entries(SharedBases bases, std::vector<PackedCouplings> couplings) {
  bases_ = std::move(bases);
  couplings_ = std::move(couplings);
  place_.resize(area().size());
  for (std::uint32_t c = 0; c < bases_.cell_count(); ++c) {
    for (std::uint32_t k = 0; k < bases_.patches[c].size(); ++k) {
      place_[bases_.patches[c][k]] = {c, k};
    }
  }
}

struct SolvedMatrix::Run {
  std::uint32_t cell = 0;
  Index begin = 0;   ///< of its first patch in the list
  MatrixXf vectors;  ///< rows of the basis of the cell, [patches of the run][rank]
};

std::vector<SolvedMatrix::Run> SolvedMatrix::runs_of(std::uint32_t matrix,
                                                     std::span<const std::uint32_t> patches,
                                                     Which vectors) const {
  std::vector<Run> runs;
  for (std::size_t begin = 0, end = 0; begin < patches.size(); begin = end) {
    const std::uint32_t cell = place_[patches[begin]].cell;
    while (end < patches.size() && place_[patches[end]].cell == cell) ++end;
    const SharedBases::Basis& basis = bases_.bases[matrix][cell];
    const Index rank = vectors == Which::kAll ? basis.vectors.cols() : basis.far_rank;
    std::vector<Index> rows;
    for (std::size_t k = begin; k < end; ++k) rows.push_back(place_[patches[k]].index);
    runs.push_back(
        {cell, static_cast<Index>(begin), basis.vectors(rows, Eigen::seqN(Index{0}, rank))});
  }
  return runs;
}

MatrixXf SolvedMatrix::coupling(std::uint32_t matrix, std::uint32_t row,
                                std::uint32_t column) const {
  const std::uint32_t low = std::min(row, column), high = std::max(row, column);
  if (couplings_[low].empty()) {
    return MatrixXf::Zero(bases_.coupled_rank(matrix, row, column),
                          bases_.coupled_rank(matrix, column, row));
  }
  MatrixXf coupling = unpack_coupling(bases_, matrix, high, low, couplings_[low]);
  if (row < column) coupling.transposeInPlace();
  return coupling;
}

void SolvedMatrix::add_later_bounces(std::uint32_t matrix, const Run& row, const Run& column,
                                     Eigen::Ref<MatrixXf> entries) const {
  if (couplings_[std::min(row.cell, column.cell)].empty()) return;
  const MatrixXf between = coupling(matrix, row.cell, column.cell);
  auto part = entries.block(row.begin, column.begin, row.vectors.rows(), column.vectors.rows());
  const MatrixXf right = between * column.vectors.leftCols(between.cols()).transpose();
  part.noalias() += row.vectors.leftCols(between.rows()) * right;
}

void SolvedMatrix::add_later_bounces(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                                     std::span<const std::uint32_t> columns,
                                     const Eigen::Ref<MatrixXf>& entries) const {
  const std::vector<Run> row_runs = runs_of(matrix, rows), column_runs = runs_of(matrix, columns);
  for (const Run& column : column_runs) {
    for (const Run& row : row_runs) add_later_bounces(matrix, row, column, entries);
  }
}

void SolvedMatrix::entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                           std::span<const std::uint32_t> columns,
                           Eigen::Ref<MatrixXf> entries) const {
  solved_.form_factors().entries(0, rows, columns, entries);
  add_later_bounces(matrix, rows, columns, entries);
}

std::vector<MatrixXf> SolvedMatrix::all_entries(std::span<const std::uint32_t> rows,
                                                std::span<const std::uint32_t> columns) const {
  MatrixXf first_bounce(rows.size(), columns.size());
  solved_.form_factors().entries(0, rows, columns, first_bounce);
  std::vector<MatrixXf> all(matrix_count(), first_bounce);
  for (std::uint32_t m = 0; m < matrix_count(); ++m) add_later_bounces(m, rows, columns, all[m]);
  return all;
}

bool SolvedMatrix::are_apart(std::span<const std::uint32_t> rows,
                             std::span<const std::uint32_t> columns) const {
  if (bases_.group.empty()) return false;
  const auto group_of = [&](std::uint32_t patch) { return bases_.group[place_[patch].cell]; };
  std::bitset<kMostPatchGroups> of_rows;
  for (const std::uint32_t p : rows) of_rows.set(group_of(p));
  return std::ranges::none_of(columns, [&](std::uint32_t p) { return of_rows[group_of(p)]; });
}

EntryParts SolvedMatrix::later_parts(std::uint32_t matrix, std::span<const Run> left,
                                     std::span<const Run> right) const {
  const auto indices = [](Index begin, Index count) {
    std::vector<std::uint32_t> list(static_cast<std::size_t>(count));
    std::iota(list.begin(), list.end(), static_cast<std::uint32_t>(begin));
    return list;
  };
  const Index right_count = right.empty() ? 0 : right.back().begin + right.back().vectors.rows();
  EntryParts parts;
  for (const Run& run : left) {
    if (run.vectors.cols() == 0) continue;
    EntryPart part{indices(run.begin, run.vectors.rows()), indices(0, right_count), run.vectors,
                   MatrixXf::Zero(right_count, run.vectors.cols())};
    for (const Run& other : right) {
      const MatrixXf between = coupling(matrix, run.cell, other.cell);
      part.right.block(other.begin, 0, other.vectors.rows(), between.rows()).noalias() =
          other.vectors.leftCols(between.cols()) * between.transpose();
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

EntryParts SolvedMatrix::later_parts(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                                     std::span<const std::uint32_t> columns) const {
  const Which which = are_apart(rows, columns) ? Which::kFar : Which::kAll;
  const std::vector<Run> of_rows = runs_of(matrix, rows, which),
                         of_columns = runs_of(matrix, columns, which);
  const auto vector_count = [](const std::vector<Run>& runs) {
    Index count = 0;
    for (const Run& run : runs) count += run.vectors.cols();
    return count;
  };
  if (vector_count(of_rows) <= vector_count(of_columns)) {
    return later_parts(matrix, of_rows, of_columns);
  }
  EntryParts parts = later_parts(matrix, of_columns, of_rows);
  for (EntryPart& part : parts) {
    std::swap(part.rows, part.columns);
    std::swap(part.left, part.right);
  }
  return parts;
}

std::optional<JointEntryParts> SolvedMatrix::parts(std::span<const std::uint32_t> rows,
                                                   std::span<const std::uint32_t> columns) const {
  std::optional<JointEntryParts> first_bounce = solved_.form_factors().parts(rows, columns);
  if (!first_bounce) return std::nullopt;
  JointEntryParts all{std::move(first_bounce->own.front()), {}};
  for (std::uint32_t m = 0; m < matrix_count(); ++m) {
    Index values = 0;
    for (const EntryPart& part : all.own.emplace_back(later_parts(m, rows, columns))) {
      values += part.value_count();
    }
    if (!are_few(values, rows.size(), columns.size())) return std::nullopt;
  }
  return all;
}

}  // namespace rebounce

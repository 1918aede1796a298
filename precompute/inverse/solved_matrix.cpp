#include "precompute/inverse/solved_matrix.h"

#include <algorithm>
#include <bitset>

namespace rebounce {

using Eigen::Index;
using Eigen::MatrixXf;

namespace {

// The least ratio of the sides of factors to their width: wider ones save nothing (lab/179).
constexpr Index kSideOverVectors = 4;

}  // namespace

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
  Index first = 0;   ///< of its vectors among those of all runs
  MatrixXf vectors;  ///< rows of the basis of the cell, [patches of the run][rank]
};

std::vector<SolvedMatrix::Run> SolvedMatrix::runs_of(std::uint32_t matrix,
                                                     std::span<const std::uint32_t> patches,
                                                     Which vectors) const {
  std::vector<Run> runs;
  Index first = 0;
  for (std::size_t begin = 0, end = 0; begin < patches.size(); begin = end) {
    const std::uint32_t cell = place_[patches[begin]].cell;
    while (end < patches.size() && place_[patches[end]].cell == cell) ++end;
    const SharedBases::Basis& basis = bases_.bases[matrix][cell];
    const Index rank = vectors == Which::kAll ? basis.vectors.cols() : basis.far_rank;
    Run& run = runs.emplace_back(Run{cell, static_cast<Index>(begin), first, {}});
    run.vectors.resize(static_cast<Index>(end - begin), rank);
    for (std::size_t k = begin; k < end; ++k) {
      run.vectors.row(static_cast<Index>(k - begin)) =
          basis.vectors.row(place_[patches[k]].index).head(rank);
    }
    first += rank;
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

std::optional<EntryFactors> SolvedMatrix::far_factors(
    std::uint32_t matrix, std::span<const std::uint32_t> rows,
    std::span<const std::uint32_t> columns) const {
  const std::vector<Run> row_runs = runs_of(matrix, rows, Which::kFar),
                         column_runs = runs_of(matrix, columns, Which::kFar);
  const auto vector_count = [](const std::vector<Run>& runs) {
    return runs.empty() ? 0 : runs.back().first + runs.back().vectors.cols();
  };
  // The product is as narrow as the side with fewer vectors.
  const Index of_rows = vector_count(row_runs), of_columns = vector_count(column_runs),
              width = std::min(of_rows, of_columns);
  const auto least_side = static_cast<Index>(std::min(rows.size(), columns.size()));
  if (kSideOverVectors * width > least_side) return std::nullopt;
  MatrixXf couplings(of_rows, of_columns);
  for (const Run& column : column_runs) {
    for (const Run& row : row_runs) {
      couplings.block(row.first, column.first, row.vectors.cols(), column.vectors.cols()) =
          coupling(matrix, row.cell, column.cell);
    }
  }
  const auto times = [](std::span<const std::uint32_t> patches, const std::vector<Run>& runs,
                        const MatrixXf& factor) {
    MatrixXf product(patches.size(), factor.cols());
    for (const Run& run : runs) {
      product.middleRows(run.begin, run.vectors.rows()).noalias() =
          run.vectors * factor.middleRows(run.first, run.vectors.cols());
    }
    return product;
  };
  const MatrixXf identity = MatrixXf::Identity(width, width);
  if (of_rows <= of_columns) {
    return EntryFactors{times(rows, row_runs, identity),
                        times(columns, column_runs, couplings.transpose())};
  }
  return EntryFactors{times(rows, row_runs, couplings), times(columns, column_runs, identity)};
}

std::optional<std::vector<EntryFactors>> SolvedMatrix::factors(
    std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns) const {
  if (!are_apart(rows, columns)) return std::nullopt;
  const auto first_bounce = solved_.form_factors().factors(rows, columns);
  if (!first_bounce) return std::nullopt;
  const auto joined = [](const MatrixXf& a, const MatrixXf& b) {
    MatrixXf both(a.rows(), a.cols() + b.cols());
    both.leftCols(a.cols()) = a;
    both.rightCols(b.cols()) = b;
    return both;
  };
  const EntryFactors& first = first_bounce->front();
  std::vector<EntryFactors> all;
  for (std::uint32_t m = 0; m < matrix_count(); ++m) {
    const std::optional<EntryFactors> later = far_factors(m, rows, columns);
    if (!later) return std::nullopt;
    all.push_back({joined(first.rows, later->rows), joined(first.columns, later->columns)});
  }
  return all;
}

}  // namespace rebounce

#include "precompute/inverse/solved_matrix.h"

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
                                                     std::span<const std::uint32_t> patches) const {
  std::vector<Run> runs;
  for (std::size_t begin = 0, end = 0; begin < patches.size(); begin = end) {
    const std::uint32_t cell = place_[patches[begin]].cell;
    while (end < patches.size() && place_[patches[end]].cell == cell) ++end;
    const MatrixXf& basis = bases_.bases[matrix][cell].vectors;
    Run& run = runs.emplace_back(Run{cell, static_cast<Index>(begin), {}});
    run.vectors.resize(static_cast<Index>(end - begin), basis.cols());
    for (std::size_t k = begin; k < end; ++k) {
      run.vectors.row(static_cast<Index>(k - begin)) = basis.row(place_[patches[k]].index);
    }
  }
  return runs;
}

void SolvedMatrix::add_later_bounces(std::uint32_t matrix, const Run& row, const Run& column,
                                     Eigen::Ref<MatrixXf> entries) const {
  const bool mirrored = row.cell < column.cell;
  const std::uint32_t low = mirrored ? row.cell : column.cell;
  if (couplings_[low].empty()) return;
  const MatrixXf coupling =
      unpack_coupling(bases_, matrix, mirrored ? column.cell : row.cell, low, couplings_[low]);
  auto part = entries.block(row.begin, column.begin, row.vectors.rows(), column.vectors.rows());
  const auto of_row = row.vectors.leftCols(mirrored ? coupling.cols() : coupling.rows());
  const auto of_column = column.vectors.leftCols(mirrored ? coupling.rows() : coupling.cols());
  const MatrixXf right = mirrored ? MatrixXf(coupling.transpose() * of_column.transpose())
                                  : MatrixXf(coupling * of_column.transpose());
  part.noalias() += of_row * right;
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

}  // namespace rebounce

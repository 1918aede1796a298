#include "precompute/base/symmetric_matrix.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "precompute/base/blas.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

constexpr Index kTile = DenseOperator::kTile;
using Tile = Eigen::Matrix<float, kTile, kTile, Eigen::RowMajor>;
using RowMajorMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Rows and columns that are read together. Threads share the columns, so these are few; a matrix
// made of links is read column by column, so rows are many.
constexpr std::size_t kBatchRows = 2048, kBatchColumns = 256;

/// Patches [begin, begin + count) of a list, cut at its end.
std::span<const std::uint32_t> part_of(std::span<const std::uint32_t> patches, std::size_t begin,
                                       std::size_t count) {
  return patches.subspan(begin, std::min(count, patches.size() - begin));
}

std::vector<std::uint32_t> with_role(std::span<const std::uint32_t> patches,
                                     const PatchRoles& roles, std::uint8_t bit) {
  std::vector<std::uint32_t> chosen;
  for (const std::uint32_t p : patches) {
    if (roles.has(p, bit)) chosen.push_back(p);
  }
  return chosen;
}

}  // namespace

std::vector<MatrixXf> SymmetricMatrix::all_entries(std::span<const std::uint32_t> rows,
                                                   std::span<const std::uint32_t> columns) const {
  std::vector<MatrixXf> all(matrix_count(), MatrixXf(rows.size(), columns.size()));
  for (std::uint32_t m = 0; m < matrix_count(); ++m) entries(m, rows, columns, all[m]);
  return all;
}

Eigen::VectorXd SymmetricMatrix::energies(std::span<const std::uint32_t> order) const {
  load_blas();
  const auto sources = with_role(order, roles_, PatchRoles::kSource);
  const auto receivers = with_role(order, roles_, PatchRoles::kReceiver);
  Eigen::VectorXd energy = Eigen::VectorXd::Zero(static_cast<Index>(order.size()));
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t column = 0; column < sources.size(); column += kBatchColumns) {
    const auto columns = part_of(sources, column, kBatchColumns);
    for (std::size_t row = 0; row < receivers.size(); row += kBatchRows) {
      const auto rows = part_of(receivers, row, kBatchRows);
      if (is_zero(rows, columns)) continue;
      MatrixXf part(rows.size(), columns.size());
      for (std::uint32_t m = 0; m < matrix_count(); ++m) {
        entries(m, rows, columns, part);
        const Eigen::VectorXd squares = part.cast<double>().colwise().squaredNorm();
        for (std::size_t k = 0; k < columns.size(); ++k) {
          energy[columns[k]] += squares[static_cast<Index>(k)];
        }
      }
    }
  }
  return energy;
}

void DenseMatrix::entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                          std::span<const std::uint32_t> columns,
                          Eigen::Ref<MatrixXf> entries) const {
  const float* const tiles = tiles_of(matrix);
  const auto m = static_cast<Index>(rows.size()), n = static_cast<Index>(columns.size());
  // Square by square: patches that are close in the order of clusters mostly share cache lines.
  for (Index first_column = 0; first_column < n; first_column += kTile) {
    const Index end_column = std::min(first_column + kTile, n);
    for (Index first_row = 0; first_row < m; first_row += kTile) {
      const Index end_row = std::min(first_row + kTile, m);
      for (Index j = first_column; j < end_column; ++j) {
        for (Index i = first_row; i < end_row; ++i) {
          entries(i, j) = tiles[DenseOperator::entry_index(rows[i], columns[j])];
        }
      }
    }
  }
}

const float* DenseMatrix::tiles_of(std::uint32_t matrix) const {
  const DenseOperator::Storage& storage = dense_.storage();
  assert(storage.precision == Precision::kF32);
  return storage.tiles_f32.data() +
         matrix * DenseOperator::tile_count(dense_.patch_count()) * kTile * kTile;
}

MatrixXf DenseMatrix::multiply(std::uint32_t matrix, const MatrixXf& x) const {
  load_blas();
  const auto n = static_cast<Index>(dense_.patch_count());
  const Index side = (n + kTile - 1) / kTile;
  const float* const tiles = tiles_of(matrix);
  const auto tile = [&](Index row, Index column) {
    return Eigen::Map<const Tile>(tiles + (row * (row + 1) / 2 + column) * kTile * kTile);
  };
  MatrixXf padded = MatrixXf::Zero(side * kTile, x.cols());
  padded.topRows(n) = x;
  MatrixXf result(side * kTile, x.cols());
  // Each tile is read once for all vectors.
#pragma omp parallel for schedule(dynamic, 1)
  for (Index i = 0; i < side; ++i) {
    MatrixXf sum = MatrixXf::Zero(kTile, x.cols());
    for (Index j = 0; j < side; ++j) {
      const auto part = padded.middleRows(j * kTile, kTile);
      if (j <= i) {
        sum.noalias() += tile(i, j) * part;
      } else {
        sum.noalias() += tile(j, i).transpose() * part;
      }
    }
    result.middleRows(i * kTile, kTile) = sum;
  }
  return result.topRows(n);
}

FormFactorMatrix::FormFactorMatrix(const ExchangeMatrix& exchange, std::span<const float> area)
    : area_(area), rows_(exchange, area) {
  root_area_.reserve(area.size());
  for (const float a : area) root_area_.push_back(std::sqrt(a));
}

void FormFactorMatrix::entries(std::uint32_t /*matrix*/, std::span<const std::uint32_t> rows,
                               std::span<const std::uint32_t> columns,
                               Eigen::Ref<MatrixXf> entries) const {
  std::vector<std::uint32_t> place(root_area_.size(), kNone);  // column of each patch, or kNone
  for (std::size_t j = 0; j < columns.size(); ++j)
    place[columns[j]] = static_cast<std::uint32_t>(j);
  entries.setZero();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t row = rows[i];
    const auto seen = rows_.columns(row);
    const auto form_factor = rows_.form_factors(row);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (place[seen[k]] == kNone) continue;
      entries(static_cast<Index>(i), place[seen[k]]) =
          static_cast<float>(form_factor[k] * root_area_[row] / root_area_[seen[k]]);
    }
  }
}

// Rows are expanded to full length, some at a time. Most patches of a room see each other, and a
// product of full matrices is many times faster than gathering entry by entry.
MatrixXf FormFactorMatrix::multiply(std::uint32_t /*matrix*/, const MatrixXf& x) const {
  load_blas();
  const Index n = x.rows(), strips = (n + kTile - 1) / kTile;
  MatrixXf result(n, x.cols());
#pragma omp parallel
  {
    RowMajorMatrixXf strip(kTile, n);
#pragma omp for schedule(dynamic, 1)
    for (Index s = 0; s < strips; ++s) {
      const Index first = s * kTile, count = std::min(kTile, n - first);
      strip.setZero();
      for (Index r = 0; r < count; ++r)
        spread_row(static_cast<std::uint32_t>(first + r), strip.row(r));
      result.middleRows(first, count).noalias() = strip.topRows(count) * x;
    }
  }
  return result;
}

void FormFactorMatrix::spread_row(std::uint32_t row, Eigen::Ref<Eigen::RowVectorXf> entries) const {
  const auto seen = rows_.columns(row);
  const auto form_factor = rows_.form_factors(row);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    entries[seen[k]] = static_cast<float>(form_factor[k] * root_area_[row] / root_area_[seen[k]]);
  }
}

}  // namespace rebounce

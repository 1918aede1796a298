#include "precompute/compression/equilibrated_matrix.h"

#include <cmath>

namespace rebounce {

EquilibratedMatrix::EquilibratedMatrix(const SymmetricMatrix& matrix,
                                       std::span<const std::int8_t> exponent)
    : SymmetricMatrix(matrix.roles()),
      matrix_(matrix),
      inverse_(static_cast<Eigen::Index>(exponent.size())) {
  for (std::size_t p = 0; p < exponent.size(); ++p) {
    inverse_[static_cast<Eigen::Index>(p)] = std::ldexp(1.0F, -exponent[p]);
  }
}

void EquilibratedMatrix::entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                                 std::span<const std::uint32_t> columns,
                                 Eigen::Ref<Eigen::MatrixXf> entries) const {
  matrix_.entries(matrix, rows, columns, entries);
  equilibrate(rows, columns, entries);
}

std::vector<Eigen::MatrixXf> EquilibratedMatrix::all_entries(
    std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns) const {
  std::vector<Eigen::MatrixXf> all = matrix_.all_entries(rows, columns);
  for (Eigen::MatrixXf& entries : all) equilibrate(rows, columns, entries);
  return all;
}

std::optional<JointEntryParts> EquilibratedMatrix::parts(
    std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns) const {
  std::optional<JointEntryParts> all = matrix_.parts(rows, columns);
  if (!all) return all;
  const auto scales = [&](std::span<const std::uint32_t> patches,
                          const std::vector<std::uint32_t>& indices) {
    Eigen::VectorXf scale(static_cast<Eigen::Index>(indices.size()));
    for (Eigen::Index k = 0; k < scale.size(); ++k) scale[k] = inverse_[patches[indices[k]]];
    return scale;
  };
  const auto equilibrate = [&](EntryPart& part) {
    const Eigen::VectorXf of_rows = scales(rows, part.rows),
                          of_columns = scales(columns, part.columns);
    part.left = of_rows.asDiagonal() * part.left;
    if (part.is_product()) {
      part.right = of_columns.asDiagonal() * part.right;
    } else {
      part.left = part.left * of_columns.asDiagonal();
    }
  };
  for (EntryPart& part : all->common) equilibrate(part);
  for (EntryParts& of_matrix : all->own) {
    for (EntryPart& part : of_matrix) equilibrate(part);
  }
  return all;
}

void EquilibratedMatrix::equilibrate(std::span<const std::uint32_t> rows,
                                     std::span<const std::uint32_t> columns,
                                     Eigen::Ref<Eigen::MatrixXf> entries) const {
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const float of_column = inverse_[columns[j]];
    for (std::size_t i = 0; i < rows.size(); ++i) {
      entries(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) *=
          inverse_[rows[i]] * of_column;
    }
  }
}

Eigen::MatrixXf EquilibratedMatrix::multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const {
  return inverse_.asDiagonal() * matrix_.multiply(matrix, inverse_.asDiagonal() * x);
}

}  // namespace rebounce

#include "symmetric_matrix.h"

#include <cmath>

namespace rebounce {

void DenseMatrix::entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                          std::span<const std::uint32_t> columns,
                          Eigen::Ref<Eigen::MatrixXf> entries) const {
  for (std::size_t j = 0; j < columns.size(); ++j) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      entries(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          dense_.symmetric_entry(matrix, rows[i], columns[j]);
    }
  }
}

double DenseMatrix::norm_squared() const {
  const std::size_t n = dense_.patch_count();
  double sum = 0;
  for (std::uint32_t m = 0; m < matrix_count(); ++m) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        const double entry = dense_.symmetric_entry(m, i, j);
        sum += (i == j ? 1 : 2) * entry * entry;
      }
    }
  }
  return sum;
}

std::vector<Float3> DenseMatrix::multiply(std::span<const Float3> light) const {
  std::vector<float> workspace(dense_.workspace_size());
  std::vector<Float3> result(light.size());
  dense_.apply(light, result, workspace);
  return result;
}

FormFactorMatrix::FormFactorMatrix(const ExchangeMatrix& exchange, std::span<const float> area)
    : exchange_(exchange), rows_(exchange, area) {
  root_area_.reserve(area.size());
  for (const float a : area) root_area_.push_back(std::sqrt(a));
}

void FormFactorMatrix::entries(std::uint32_t /*matrix*/, std::span<const std::uint32_t> rows,
                               std::span<const std::uint32_t> columns,
                               Eigen::Ref<Eigen::MatrixXf> entries) const {
  std::vector<std::uint32_t> place(root_area_.size(), kNone);  // of a patch among the columns
  for (std::size_t j = 0; j < columns.size(); ++j)
    place[columns[j]] = static_cast<std::uint32_t>(j);
  entries.setZero();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t row = rows[i];
    const auto seen = rows_.columns(row);
    const auto form_factor = rows_.form_factors(row);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (place[seen[k]] == kNone) continue;
      entries(static_cast<Eigen::Index>(i), place[seen[k]]) =
          static_cast<float>(form_factor[k] * root_area_[row] / root_area_[seen[k]]);
    }
  }
}

double FormFactorMatrix::norm_squared() const {
  double sum = 0;
  for (std::size_t i = 0; i < root_area_.size(); ++i) {
    for (std::uint64_t k = exchange_.row_begin[i]; k < exchange_.row_begin[i + 1]; ++k) {
      const double entry =
          exchange_.exchange_area[k] / (root_area_[i] * root_area_[exchange_.column[k]]);
      sum += (exchange_.column[k] == i ? 1 : 2) * entry * entry;
    }
  }
  return sum;
}

std::vector<Float3> FormFactorMatrix::multiply(std::span<const Float3> light) const {
  std::vector<Float3> result(light.size());
  rows_.gather(light, result);
  return result;
}

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "precompute/base/symmetric_matrix.h"

namespace rebounce {

/// The factor K of a matrix R K R: the matrix with each row and column divided by the scale of its
/// patch, a power of two (symmetric equilibration: N. J. Higham, "Accuracy and Stability of
/// Numerical Algorithms", 2002, section 7.3).
class EquilibratedMatrix final : public SymmetricMatrix {
 public:
  /// `matrix` must outlive it; R is 2^`exponent` [n], by patch.
  EquilibratedMatrix(const SymmetricMatrix& matrix, std::span<const std::int8_t> exponent);
  EquilibratedMatrix(const SymmetricMatrix&& matrix,
                     std::span<const std::int8_t> exponent) = delete;

  std::span<const float> area() const override { return matrix_.area(); }
  std::uint32_t matrix_count() const override { return matrix_.matrix_count(); }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const override {
    return matrix_.channel_matrix();
  }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  std::vector<Eigen::MatrixXf> all_entries(std::span<const std::uint32_t> rows,
                                           std::span<const std::uint32_t> columns) const override;
  bool is_zero(std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns) const override {
    return matrix_.is_zero(rows, columns);
  }
  bool has_parts() const override { return matrix_.has_parts(); }
  std::optional<JointEntryParts> parts(std::span<const std::uint32_t> rows,
                                       std::span<const std::uint32_t> columns) const override;
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override;

 private:
  void equilibrate(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns,
                   Eigen::Ref<Eigen::MatrixXf> entries) const;

  const SymmetricMatrix& matrix_;
  Eigen::VectorXf inverse_;  ///< [n] inverse of R
};

}  // namespace rebounce

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "transfer/data/patch_roles.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce {

/// What is compressed: a matrix M over the patches for each distinct channel, in its symmetric form
/// A^1/2 M A^-1/2. Any number of threads may ask.
class SymmetricMatrix {
 public:
  /// Of the matrix, the rows of receivers and the columns of sources are wanted.
  explicit SymmetricMatrix(PatchRoles roles = {}) : roles_(std::move(roles)) {}
  virtual ~SymmetricMatrix() = default;

  /// Entries and products are nevertheless those of the whole matrix.
  const PatchRoles& roles() const { return roles_; }

  /// [n] m².
  virtual std::span<const float> area() const = 0;
  /// Distinct matrices, and which of them each channel has: by default one for all channels.
  virtual std::uint32_t matrix_count() const { return 1; }
  virtual std::array<std::uint32_t, kChannelCount> channel_matrix() const { return {0, 0, 0}; }

  /// Writes the entries between two lists of patches without repetitions, which are the same or
  /// have none in common; `entries` is [rows][columns].
  virtual void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                       std::span<const std::uint32_t> columns,
                       Eigen::Ref<Eigen::MatrixXf> entries) const = 0;

  /// The product with many vectors at once, x [n][k]. The same bits for any number of threads.
  virtual Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const = 0;

  /// What arrives at receivers of the light of each source alone: the squared norms of the columns,
  /// of all matrices together, [n] by patch, 0 for others. `order` lists the patches so that
  /// neighbours stay together.
  virtual Eigen::VectorXd energies(std::span<const std::uint32_t> order) const;

 private:
  PatchRoles roles_;
};

/// Yhat, from an operator in f32.
class DenseMatrix final : public SymmetricMatrix {
 public:
  explicit DenseMatrix(const DenseOperator& dense, PatchRoles roles = {})
      : SymmetricMatrix(std::move(roles)), dense_(dense) {}

  std::span<const float> area() const override { return dense_.storage().area; }
  std::uint32_t matrix_count() const override { return dense_.storage().matrix_count; }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const override {
    return dense_.storage().channel_matrix;
  }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override;

 private:
  const float* tiles_of(std::uint32_t matrix) const;

  const DenseOperator& dense_;
};

/// G = A^1/2 F A^-1/2 from sparse exchange areas: one matrix for all channels.
class FormFactorMatrix final : public SymmetricMatrix {
 public:
  FormFactorMatrix(const ExchangeMatrix& exchange, std::span<const float> area);

  std::span<const float> area() const override { return area_; }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override;

 private:
  /// Writes the entries of a row that are not 0 into `entries` [n].
  void spread_row(std::uint32_t row, Eigen::Ref<Eigen::RowVectorXf> entries) const;

  std::span<const float> area_;
  FormFactorRows rows_;
  std::vector<double> root_area_;  ///< [n]
};

}  // namespace rebounce

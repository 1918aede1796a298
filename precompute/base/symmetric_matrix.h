#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "precompute/base/entry_parts.h"
#include "rebounce/scene_data.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce {

/// The most groups that the patches of a matrix have.
inline constexpr std::size_t kMostPatchGroups = 64;

/// What compression reads: a matrix M over the patches for each distinct channel, in its symmetric
/// form A^1/2 M A^-1/2, where A holds the areas. Usable from any number of threads.
class SymmetricMatrix {
 public:
  /// `roles`: the rows of receivers and the columns of sources are wanted. `group` [n] or empty:
  /// patches of different groups, below kMostPatchGroups, have small entries between them.
  explicit SymmetricMatrix(PatchRoles roles = {}, std::vector<std::uint8_t> group = {})
      : roles_(std::move(roles)), group_(std::move(group)) {}
  virtual ~SymmetricMatrix() = default;

  /// Entries and products are those of the whole matrix, whatever the roles.
  const PatchRoles& roles() const { return roles_; }
  /// The group of each patch, [n]; empty if all are of one.
  const std::vector<std::uint8_t>& group() const { return group_; }

  /// [n] m².
  virtual std::span<const float> area() const = 0;
  /// The number of distinct matrices, and the matrix of each channel. By default one serves all
  /// channels.
  virtual std::uint32_t matrix_count() const { return 1; }
  virtual std::array<std::uint32_t, kChannelCount> channel_matrix() const { return {0, 0, 0}; }

  /// Writes the entries between two lists of patches to `entries` [rows][columns]. A list has no
  /// repetitions; the two lists are equal or have no patch in common.
  virtual void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                       std::span<const std::uint32_t> columns,
                       Eigen::Ref<Eigen::MatrixXf> entries) const = 0;

  /// The entries of each of the matrices.
  virtual std::vector<Eigen::MatrixXf> all_entries(std::span<const std::uint32_t> rows,
                                                   std::span<const std::uint32_t> columns) const;

  /// Whether all entries between two lists are known to be 0, in all of the matrices.
  virtual bool is_zero(std::span<const std::uint32_t> /*rows*/,
                       std::span<const std::uint32_t> /*columns*/) const {
    return false;
  }

  /// Whether `parts` ever gives any.
  virtual bool has_parts() const { return false; }

  /// The entries of all matrices as sums of parts, whose rows and columns are indices in the two
  /// lists; nothing where they are not few.
  virtual std::optional<JointEntryParts> parts(std::span<const std::uint32_t> /*rows*/,
                                               std::span<const std::uint32_t> /*columns*/) const {
    return std::nullopt;
  }

  /// Whether parts of this many values are worth it in place of the entries of a block, of one
  /// matrix.
  static bool are_few(Eigen::Index value_count, std::size_t rows, std::size_t columns) {
    return kEntriesOverValues * static_cast<std::size_t>(value_count) <= rows * columns;
  }

  /// The product with many vectors at once, x [n][k]. The bits do not depend on the number of
  /// threads.
  virtual Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const = 0;

  /// The squared norms of the columns in the rows of receivers, summed over all matrices, [n] by
  /// patch: the energy that receivers get from each source alone. 0 for patches that are no
  /// sources. `order` lists the patches so that neighbours stay together.
  virtual Eigen::VectorXd energies(std::span<const std::uint32_t> order) const;

 private:
  static constexpr std::size_t kEntriesOverValues = 2;  // lab/180

  PatchRoles roles_;
  std::vector<std::uint8_t> group_;
};

/// Yhat, from a dense operator in f32.
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
  /// Writes the nonzero entries of a row into `entries` [n].
  void spread_row(std::uint32_t row, Eigen::Ref<Eigen::RowVectorXf> entries) const;

  std::span<const float> area_;
  FormFactorRows rows_;
  std::vector<double> root_area_;  ///< [n] square roots of the areas
};

}  // namespace rebounce

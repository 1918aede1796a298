#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/precompute/hierarchical_transfer.h"
#include "rebounce/transfer/dense_operator.h"
#include "rebounce/transfer/exchange_matrix.h"

namespace rebounce {

/// What is compressed: a matrix M over the patches for each distinct channel, whose form
/// A^1/2 M A^-1/2 is symmetric and gives blocks of its entries. Any number of threads may ask.
class SymmetricMatrix {
 public:
  virtual ~SymmetricMatrix() = default;

  virtual std::uint32_t matrix_count() const = 0;
  virtual std::array<std::uint32_t, kChannelCount> channel_matrix() const = 0;

  /// Writes the entries of the symmetric form between two lists of patches without repetitions,
  /// which are the same or have none in common; `entries` is [rows][columns].
  virtual void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                       std::span<const std::uint32_t> columns,
                       Eigen::Ref<Eigen::MatrixXf> entries) const = 0;

  /// Square of the Frobenius norm of the symmetric forms, all matrices together.
  virtual double norm_squared() const = 0;

  /// M `light`, [n][3]: the truth.
  virtual std::vector<Float3> multiply(std::span<const Float3> light) const = 0;
};

/// Yhat.
class DenseMatrix final : public SymmetricMatrix {
 public:
  explicit DenseMatrix(const DenseOperator& dense) : dense_(dense) {}

  std::uint32_t matrix_count() const override { return dense_.storage().matrix_count; }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const override {
    return dense_.storage().channel_matrix;
  }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  double norm_squared() const override;
  std::vector<Float3> multiply(std::span<const Float3> light) const override;

 private:
  const DenseOperator& dense_;
};

/// G = A^1/2 F A^-1/2 from sparse exchange areas: one matrix for all channels.
class FormFactorMatrix final : public SymmetricMatrix {
 public:
  FormFactorMatrix(const ExchangeMatrix& exchange, std::span<const float> area);

  std::uint32_t matrix_count() const override { return 1; }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const override { return {0, 0, 0}; }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  double norm_squared() const override;
  std::vector<Float3> multiply(std::span<const Float3> light) const override;

 private:
  const ExchangeMatrix& exchange_;
  FormFactorRows rows_;
  std::vector<double> root_area_;  ///< [n]
};

/// Compresses `matrix` as compress_transfer does.
HierarchicalOperator::Storage compress_matrix(const SymmetricMatrix& matrix,
                                              const PatchTable& patches, double price,
                                              const Progress& progress = {});

/// Compresses `matrix` to a tolerance as build_hierarchical_transfer does.
std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches,
    std::span<const std::vector<Float3>> test_lights, const HierarchicalSettings& settings,
    const Progress& progress = {});

}  // namespace rebounce

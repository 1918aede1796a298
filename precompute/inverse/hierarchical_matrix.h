#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// A hierarchical operator of any precision as a matrix, in f32.
class HierarchicalMatrix final : public SymmetricMatrix {
 public:
  /// Some vectors side by side: the rows are positions, with those that hold no patch.
  using Vectors = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  explicit HierarchicalMatrix(const HierarchicalStorage& storage);

  std::span<const float> area() const override { return storage_.area; }
  std::uint32_t matrix_count() const override { return storage_.matrix_count; }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const override {
    return storage_.channel_matrix;
  }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override;

  Eigen::Index position_count() const;
  std::span<const std::uint32_t> patch() const { return storage_.patch; }  ///< [n] at each position

  /// What `multiply` needs beside its vectors.
  struct Workspace {
    Vectors sent, received;  ///< coefficients before and after the coupling matrices
  };

  /// y = matrix x on one thread, all [positions][k]; y must not be x.
  void multiply(std::uint32_t matrix, const Vectors& x, Vectors& y, Workspace& workspace) const;

 private:
  /// Where a patch of a list is, and which of them it is.
  struct Place {
    std::uint32_t position, index;
  };
  /// Such a list by position.
  struct Places;

  void take_scales();
  void sort_blocks();
  /// The entries of a block in some of its rows and columns.
  Eigen::MatrixXf block_entries(std::uint32_t matrix, std::size_t block,
                                std::span<const Place> rows, std::span<const Place> columns) const;
  void add_block(std::uint32_t matrix, std::size_t block, const Places& rows, const Places& columns,
                 Eigen::Ref<Eigen::MatrixXf> entries) const;
  void multiply_blocks(std::uint32_t matrix, const Vectors& x, Vectors& y,
                       Workspace& workspace) const;
  const float* basis(const HierarchicalLayout::End& end) const;
  const float* coupling(std::uint32_t matrix, std::size_t block) const;

  HierarchicalStorage storage_;  ///< f32, without values
  HierarchicalLayout layout_;
  std::vector<float> bases_;                          ///< [rank][size] by cluster
  std::vector<std::vector<float>> couplings_;         ///< of each matrix: S or the entries by block
  std::vector<std::uint32_t> position_;               ///< [n] of each patch
  Eigen::Index low_rank_count_ = 0;                   ///< coefficients of low-rank blocks
  std::vector<std::vector<std::uint32_t>> touching_;  ///< blocks that meet a strip of positions
};

}  // namespace rebounce

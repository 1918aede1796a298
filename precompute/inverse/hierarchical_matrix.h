#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "transfer/format/hierarchical_layout.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// A hierarchical operator of any precision as a SymmetricMatrix, decoded to f32.
class HierarchicalMatrix final : public SymmetricMatrix {
 public:
  /// A row for each position, also those that hold no patch.
  using Vectors = RowVectors;

  /// `group`: SymmetricMatrix::group.
  explicit HierarchicalMatrix(const HierarchicalStorage& storage,
                              std::vector<std::uint8_t> group = {});

  std::span<const float> area() const override { return storage_.area; }
  std::uint32_t matrix_count() const override { return storage_.matrix_count; }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const override {
    return storage_.channel_matrix;
  }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;
  bool has_parts() const override { return true; }
  /// A part for each block, as it is stored.
  std::optional<JointEntryParts> parts(std::span<const std::uint32_t> rows,
                                       std::span<const std::uint32_t> columns) const override;
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override;

  Eigen::Index position_count() const;
  /// [positions] patch at each.
  std::span<const std::uint32_t> patch() const { return storage_.patch; }
  /// [n] position of each patch.
  std::span<const std::uint32_t> position() const { return position_; }

  /// Memory that `multiply` needs beside its vectors.
  struct Workspace {
    Vectors sent, received;  ///< coefficients before and after the coupling matrices
    /// [positions + 1] positions before each at which any vector is not 0.
    std::vector<std::uint32_t> lit_before;
    std::vector<std::uint8_t> reached;  ///< clusters that receive light by a coupling matrix

    bool is_lit(Eigen::Index begin, Eigen::Index count) const {
      return lit_before[begin + count] > lit_before[begin];
    }
  };

  /// y = matrix x on the calling thread, both [positions][k]; y must not alias x. What begins where
  /// all vectors are 0 is left out: vectors of one cluster take a part of the time.
  void multiply(std::uint32_t matrix, const Vectors& x, Vectors& y, Workspace& workspace) const;

 private:
  /// The position of a patch, and its index in a list of patches.
  struct Place {
    std::uint32_t position, index;
  };
  /// The places of such a list, by position.
  struct Places;

  void fold_scales();
  void sort_blocks();
  /// The blocks, each once and in order, that meet the strips of some positions.
  std::vector<std::uint32_t> blocks_near(const Places& places) const;
  /// One side of a block: its positions, its coefficients, and the cluster of its basis.
  struct Side;
  Vectors basis_at(const HierarchicalLayout::End& end, const Side& side,
                   std::span<const Place> places) const;
  /// A part of a block that two lists of patches meet.
  struct Part;
  std::vector<Part> parts_between(const Places& rows, const Places& columns) const;
  std::pair<Vectors, Vectors> part_factors(std::uint32_t matrix, const Part& part) const;
  Eigen::MatrixXf part_entries(std::uint32_t matrix, const Part& part) const;
  EntryPart entry_part(std::uint32_t matrix, const Part& part) const;
  void find_reached(Workspace& workspace) const;
  void multiply_blocks(std::uint32_t matrix, const Vectors& x, Vectors& y,
                       Workspace& workspace) const;
  Side side_of(const TransferBlock& block, std::size_t index, bool row) const;
  const float* basis(const HierarchicalLayout::End& end) const;
  const float* coupling(std::uint32_t matrix, std::size_t block) const;

  HierarchicalStorage storage_;  ///< f32; its values are moved to the arrays below
  HierarchicalLayout layout_;
  std::vector<float> bases_;  ///< [rank][size] by cluster
  /// Of each matrix: coupling matrices or dense entries, by block.
  std::vector<std::vector<float>> couplings_;
  std::vector<std::uint32_t> position_;  ///< [n] position of each patch
  Eigen::Index low_rank_count_ = 0;      ///< number of coefficients of low-rank blocks
  /// The blocks that meet each strip of positions.
  std::vector<std::vector<std::uint32_t>> touching_;
};

}  // namespace rebounce

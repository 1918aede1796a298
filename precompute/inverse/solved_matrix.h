#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "precompute/base/symmetric_matrix.h"
#include "precompute/inverse/packed_couplings.h"
#include "precompute/inverse/shared_bases.h"
#include "precompute/inverse/solved_transfer.h"

namespace rebounce {

/// Yhat through its products, which are solved for, and through entries in shared bases: those of
/// the form factors, which are exact, and the rest between the bases of cells.
class SolvedMatrix final : public SymmetricMatrix {
 public:
  /// `solved` must outlive the object; `energies` [n] are those that it estimates with these roles;
  /// `group`: SymmetricMatrix::group.
  SolvedMatrix(const SolvedTransfer& solved, Eigen::VectorXd energies, PatchRoles roles,
               std::vector<std::uint8_t> group)
      : SymmetricMatrix(std::move(roles), std::move(group)),
        solved_(solved),
        energies_(std::move(energies)) {}

  std::span<const float> area() const override { return solved_.area(); }
  std::uint32_t matrix_count() const override { return solved_.matrix_count(); }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const override {
    return solved_.channel_matrix();
  }
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override {
    return solved_.multiply(matrix, x);
  }
  Eigen::VectorXd energies(std::span<const std::uint32_t> /*order*/) const override {
    return energies_;
  }

  /// What `entries` needs: `bases`, and the couplings of each cell, empty for a cell below which no
  /// entries are wanted.
  void set_entries(SharedBases bases, std::vector<PackedCouplings> couplings);

  /// Entries between cells without couplings are those of the form factors alone. Call set_entries
  /// before.
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;

  std::vector<Eigen::MatrixXf> all_entries(std::span<const std::uint32_t> rows,
                                           std::span<const std::uint32_t> columns) const override;

  bool has_parts() const override { return true; }
  /// Blocks of the form factors, and later bounces in the bases of cells.
  std::optional<JointEntryParts> parts(std::span<const std::uint32_t> rows,
                                       std::span<const std::uint32_t> columns) const override;

 private:
  /// Neighbours in a list of patches that lie in the same cell.
  struct Run;
  enum class Which { kAll, kFar };
  std::vector<Run> runs_of(std::uint32_t matrix, std::span<const std::uint32_t> patches,
                           Which vectors = Which::kAll) const;
  /// Whether no two patches of two lists are in cells of one group.
  bool are_apart(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns) const;
  /// The coupling between two cells, in any order; all 0 if it is not wanted.
  Eigen::MatrixXf coupling(std::uint32_t matrix, std::uint32_t row, std::uint32_t column) const;
  /// Later bounces, a part for each run of `left`.
  EntryParts later_parts(std::uint32_t matrix, std::span<const Run> left,
                         std::span<const Run> right) const;
  EntryParts later_parts(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                         std::span<const std::uint32_t> columns) const;
  void add_later_bounces(std::uint32_t matrix, const Run& row, const Run& column,
                         Eigen::Ref<Eigen::MatrixXf> entries) const;
  /// The same between two lists.
  void add_later_bounces(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                         std::span<const std::uint32_t> columns,
                         const Eigen::Ref<Eigen::MatrixXf>& entries) const;

  /// The cell of a patch, and its index there.
  struct Place {
    std::uint32_t cell = 0, index = 0;
  };

  const SolvedTransfer& solved_;
  Eigen::VectorXd energies_;
  SharedBases bases_;
  std::vector<PackedCouplings> couplings_;  ///< by cell
  std::vector<Place> place_;                ///< [n]
};

}  // namespace rebounce

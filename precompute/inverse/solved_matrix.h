#pragma once

#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/inverse/hierarchical_matrix.h"
#include "precompute/inverse/solved_transfer.h"
#include "precompute/patches/cluster_tree.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Yhat through its products, which are solved for. Derived classes provide the entries.
class SolvedMatrix : public SymmetricMatrix {
 public:
  /// `solved` must outlive the object; `energies` [n] are those that it estimates with these roles.
  SolvedMatrix(const SolvedTransfer& solved, Eigen::VectorXd energies, PatchRoles roles)
      : SymmetricMatrix(std::move(roles)), solved_(solved), energies_(std::move(energies)) {}

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

 protected:
  const SolvedTransfer& solved() const { return solved_; }

 private:
  const SolvedTransfer& solved_;
  Eigen::VectorXd energies_;
};

/// Exact columns of Yhat, for a few panels of patches at a time.
class PanelMatrix final : public SolvedMatrix {
 public:
  using SolvedMatrix::SolvedMatrix;

  /// Solves for the columns of the patches at `panels` of `tree`, neighbours in the order of
  /// positions, in the rows from there to the end: the lower triangle. The bits of a panel do not
  /// depend on the other panels. Throws Cancelled if asked to stop.
  void solve(const ClusterTree& tree, std::span<const Cluster> panels,
             const Progress& progress = {});

  /// The rows and columns must be covered by the panels.
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override;

 private:
  /// Keeps solutions [positions][k] as the columns of the panels from `begin` on.
  void keep(const SolvedTransfer::Vectors& columns, std::uint32_t matrix, std::size_t begin);

  std::vector<SolvedTransfer::Vectors> panel_;  ///< of each matrix, at least [rows][columns]
  std::vector<std::uint32_t> place_;            ///< [n] row and column of a patch
};

/// Yhat with the entries of an operator that was compressed from it, and with the roles of that
/// operator. Its products are solved for.
class RoundedMatrix final : public SolvedMatrix {
 public:
  RoundedMatrix(const SolvedTransfer& solved, Eigen::VectorXd energies,
                const HierarchicalStorage& rounded)
      : SolvedMatrix(solved, std::move(energies), rounded.roles), rounded_(rounded) {}

  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override {
    rounded_.entries(matrix, rows, columns, entries);
  }

 private:
  HierarchicalMatrix rounded_;
};

}  // namespace rebounce

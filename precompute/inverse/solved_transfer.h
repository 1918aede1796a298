#pragma once

#include <Eigen/Cholesky>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "precompute/inverse/hierarchical_matrix.h"
#include "transfer/file/transfer_data.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// Products with Yhat = G (I - R² G)^-1, R = rho^1/2, found by conjugate gradients (M. R. Hestenes,
/// E. Stiefel, 1952): no entry of it is kept.
///
/// Yhat b = G b + G R z with (I - R G R) z = R G b, symmetric positive definite as long as no
/// reflectance is 1. The sum is built up from the products G R p that the steps need anyway, so
/// that nothing is divided by R and black patches are as exact as others. Many right-hand sides are
/// solved side by side, each with steps of its own until its residual is small enough.
class SolvedTransfer {
 public:
  using Vectors = HierarchicalMatrix::Vectors;

  /// Right-hand sides that one thread solves side by side. More: larger matrix products, and more
  /// memory, five times as many vectors for each thread.
  static constexpr Eigen::Index kBatchColumns = 128;

  /// `form_factors` are G. A solution is accepted when the residual of z is `residual` of R G b.
  SolvedTransfer(const HierarchicalOperator& form_factors, const PatchTable& patches,
                 double residual);

  /// The same, but that the steps of `columns` multiply with `coarse`, which is G up to an error. G
  /// itself gives what they begin with, R G b less what leading eigenvectors have of it, and of the
  /// small rest that they are taken for an error in proportion is allowed (V. Simoncini, D. B.
  /// Szyld, "Theory of inexact Krylov subspace methods", 2003).
  SolvedTransfer(const HierarchicalOperator& form_factors, const HierarchicalStorage& coarse,
                 const PatchTable& patches, double residual);

  std::span<const float> area() const { return form_factors_.area(); }
  std::uint32_t matrix_count() const { return static_cast<std::uint32_t>(root_.size()); }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const { return channel_matrix_; }
  Eigen::Index position_count() const { return form_factors_.position_count(); }
  /// [n] patch at each position.
  std::span<const std::uint32_t> patch() const { return form_factors_.patch(); }

  /// Yhat x for vectors x [n][k] by patch. The same bits for any number of threads. Throws Error if
  /// the steps do not converge.
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const;

  /// What one thread solves with. It grows to what is needed and stays: pages of so many vectors
  /// anew for every few columns took a tenth of the time.
  struct Workspace {
    Vectors solution, residual, direction, sent, arrived;
    HierarchicalMatrix::Workspace products;
    Eigen::MatrixXf seen;  ///< entries of G, [n][k]
  };

  /// The columns of Yhat that belong to `patches`, kBatchColumns of them at most, [positions][k],
  /// on one thread; valid until the workspace is used again. Throws Error likewise.
  const Vectors& columns(std::uint32_t matrix, std::span<const std::uint32_t> patches,
                         Workspace& workspace) const;

  /// Estimates of the squared norms of the columns in the rows of receivers, all matrices together,
  /// [n] by patch: the mean over random vectors of signs s at receivers of the squares of Yhat s,
  /// whose expectation they are.
  Eigen::VectorXd estimated_energies(const PatchRoles& roles = {}) const;

 private:
  /// The leading eigenvectors V of R G R, nearly.
  struct Leading {
    Vectors vectors;                     ///< V, [positions][k], orthonormal columns
    Vectors gathered;                    ///< G R V
    Eigen::LLT<Eigen::MatrixXd> system;  ///< of V^T (I - R G R) V
  };

  Leading find_leading(const Eigen::VectorXf& root) const;

  /// G x, threads sharing the columns; all by position.
  Vectors gather(const Vectors& x) const;

  /// Moves the solution by its part in the leading eigenvectors, and the residual of z.
  void solve_leading(std::uint32_t matrix, Workspace& workspace) const;

  /// From G b to Yhat b, as the solution in `workspace`; the steps multiply with `form_factors`.
  void solve(std::uint32_t matrix, const HierarchicalMatrix& form_factors,
             Workspace& workspace) const;

  HierarchicalMatrix form_factors_;
  std::optional<HierarchicalMatrix> coarse_;
  std::array<std::uint32_t, kChannelCount> channel_matrix_{};
  std::vector<Eigen::VectorXf> root_;  ///< of each matrix: R by position, 0 where no patch is
  std::vector<Leading> leading_;       ///< of each matrix
  double residual_;
};

}  // namespace rebounce

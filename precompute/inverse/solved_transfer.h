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

/// Products with Yhat = G (I - R² G)^-1, R = rho^1/2, found by conjugate gradients (M. R. Hestenes
/// and E. Stiefel, "Methods of conjugate gradients for solving linear systems", 1952). No entry of
/// Yhat is stored.
///
/// Yhat b = G b + G R z with (I - R G R) z = R G b, which is symmetric positive definite as long as
/// no reflectance is 1. The sum is built up from the products G R p that the steps compute anyway.
/// Nothing is divided by R, so black patches are as exact as others. Many right-hand sides are
/// solved side by side, each with its own step lengths, until its residual is small enough.
class SolvedTransfer {
 public:
  using Vectors = HierarchicalMatrix::Vectors;

  /// Right-hand sides that one thread solves side by side. More of them make matrix products larger
  /// and take more memory: nine vectors for each of them and each thread (lab/060).
  static constexpr Eigen::Index kBatchColumns = 128;

  /// `form_factors` are G. A solution is accepted when the norm of the residual of z is at most
  /// `residual` times that of R G b.
  SolvedTransfer(const HierarchicalOperator& form_factors, const PatchTable& patches,
                 double residual);

  /// The same, but the steps of later_bounces multiply with `coarse`, an approximation of G. The
  /// start is computed with G itself: R G b without its part in the leading eigenvectors. The steps
  /// only solve for the small rest, so an error in proportion to it is allowed (V. Simoncini and D.
  /// B. Szyld, "Theory of inexact Krylov subspace methods and applications to scientific
  /// computing", 2003).
  SolvedTransfer(const HierarchicalOperator& form_factors, const HierarchicalStorage& coarse,
                 const PatchTable& patches, double residual);

  std::span<const float> area() const { return form_factors_.area(); }
  std::uint32_t matrix_count() const { return static_cast<std::uint32_t>(root_.size()); }
  std::array<std::uint32_t, kChannelCount> channel_matrix() const { return channel_matrix_; }
  Eigen::Index position_count() const { return form_factors_.position_count(); }
  /// [positions] patch at each.
  std::span<const std::uint32_t> patch() const { return form_factors_.patch(); }

  /// Yhat x for vectors x [n][k] by patch. The bits do not depend on the number of threads. Throws
  /// Error if the steps do not converge.
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const;

  /// The indirect irradiances [n] in lx of lights, given as initial exitances [n] in lx. Dozens of
  /// lights at a time fill the products. All ranks call it together. Throws likewise.
  std::vector<std::vector<Float3>> indirect_irradiances(
      std::span<const std::vector<Float3>> initial_exitances) const;

  /// Memory of one thread that solves. It grows to what is needed and is kept, because new pages
  /// for every few columns cost time.
  struct Workspace {
    Vectors first;  ///< G x, the light of the first bounce
    Vectors solution, residual, direction, sent, arrived;
    HierarchicalMatrix::Workspace products;
  };

  /// (Yhat - G) x, the light of all bounces but the first, for vectors x [positions][k] with k at
  /// most kBatchColumns, on the calling thread. The result, and the light of the first bounce, are
  /// valid until the workspace is used again. Throws Error if the steps do not converge.
  const Vectors& later_bounces(std::uint32_t matrix, const Vectors& x, Workspace& workspace) const;

  /// G.
  const HierarchicalMatrix& form_factors() const { return form_factors_; }

  /// Estimates of the squared norms of the columns in the rows of receivers, summed over all
  /// matrices, [n] by patch. An estimate is the mean of the squares of Yhat s over vectors s of
  /// random signs at receivers; its expectation is the squared norm.
  Eigen::VectorXd estimated_energies(const PatchRoles& roles = {}) const;

 private:
  /// The leading eigenvectors V of R G R, approximately.
  struct Leading {
    Vectors vectors;                     ///< V, [positions][k], orthonormal columns
    Vectors gathered;                    ///< G R V
    Eigen::LLT<Eigen::MatrixXd> system;  ///< of V^T (I - R G R) V
  };

  SolvedTransfer(const HierarchicalOperator& form_factors, std::optional<HierarchicalMatrix> coarse,
                 const PatchTable& patches, double residual);

  /// What steps multiply with.
  const HierarchicalMatrix& of_steps() const { return coarse_ ? *coarse_ : form_factors_; }

  Leading find_leading(const Eigen::VectorXf& root, const Leading* other) const;

  /// Adds the part of the solution in the leading eigenvectors, and updates the residual of z.
  void solve_leading(std::uint32_t matrix, Workspace& workspace) const;

  /// From the first bounce G b in `workspace`, finds the later ones, (Yhat - G) b: the solution
  /// there.
  void solve(std::uint32_t matrix, Workspace& workspace) const;

  HierarchicalMatrix form_factors_;
  std::optional<HierarchicalMatrix> coarse_;
  std::array<std::uint32_t, kChannelCount> channel_matrix_{};
  std::vector<Eigen::VectorXf> root_;  ///< of each matrix: R by position, 0 where there is no patch
  std::vector<Leading> leading_;       ///< of each matrix
  double residual_;
};

}  // namespace rebounce

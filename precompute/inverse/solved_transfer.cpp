#include "precompute/inverse/solved_transfer.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "precompute/base/blas.h"
#include "precompute/base/orthonormal_columns.h"
#include "precompute/base/parallel_loop.h"
#include "precompute/base/ranks.h"
#include "precompute/inverse/dense_transfer.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using Vectors = HierarchicalMatrix::Vectors;
using Sums = Eigen::Array<double, 1, Eigen::Dynamic>;  ///< one for each right-hand side
using Factors = Eigen::Array<float, 1, Eigen::Dynamic>;

// A bound on the steps. Residuals fall by half or more in a step even at a reflectance of 0.9.
constexpr int kMostSteps = 500;

// Number of leading eigenvectors, at most 1 / kLeadingPart of all, and of the multiplications that
// find them (lab/060), also from what the matrix before has found (lab/145).
constexpr Index kLeadingCount = 256, kLeadingPart = 8;
constexpr int kLeadingSteps = 6, kFurtherSteps = 2;

// Rows whose products are summed in single precision before they are added to the double.
constexpr Index kSummedRows = 128;

// Vectors that are multiplied side by side. They are fewer than kBatchColumns, so that threads can
// share the few vectors of lights.
constexpr Index kSmallGroup = 32;

// Random vectors for the energies. Their relative errors are sqrt(2 / 128) = 13 %; those of their
// roots, which light_weights.cpp uses, are 6 %.
constexpr Index kProbeCount = 128;

/// Gives all ranks the groups of columns that each has made, in turns.
void share_groups(const Ranks& ranks, MatrixXf& columns) {
  const auto run = static_cast<std::size_t>(kSmallGroup * columns.rows());
  ranks.share(std::span(columns.data(), static_cast<std::size_t>(columns.size())), run);
}

/// Sums of `term(first, count)`, an expression [count][k], over all rows.
template <typename Term>
Sums column_sums(Index rows, Index width, const Term& term) {
  Sums sums = Sums::Zero(width);
  for (Index first = 0; first < rows; first += kSummedRows) {
    const Index count = std::min(kSummedRows, rows - first);
    Factors part = Factors::Zero(width);
    for (Index row = first; row < first + count; ++row) part += term(row);
    sums += part.cast<double>();
  }
  return sums;
}

float sign(std::mt19937_64& engine) {
  return (engine() >> 63) != 0 ? 1.0F : -1.0F;
}

[[noreturn]] void refuse() {
  throw Error(
      "columns of the operator do not converge: the compressed form factors amplify light; "
      "compress them less");
}

Factors quotient(const Sums& a, const Sums& b) {
  return (b > 0).select(a / b, 0).cast<float>();
}

/// The product by position; threads share the columns.
Vectors gather_all(const HierarchicalMatrix& matrix, const Vectors& x) {
  load_blas();
  const Ranks ranks;
  MatrixXf result(x.rows(), x.cols());
#pragma omp parallel for schedule(dynamic, 1)
  for (Index begin = 0; begin < x.cols(); begin += kSmallGroup) {
    if (!ranks.makes(static_cast<std::size_t>(begin / kSmallGroup))) continue;
    const Index width = std::min(kSmallGroup, x.cols() - begin);
    Vectors out;
    HierarchicalMatrix::Workspace workspace;
    matrix.multiply(0, x.middleCols(begin, width), out, workspace);
    result.middleCols(begin, width) = out;
  }
  share_groups(ranks, result);
  return result;
}

}  // namespace

SolvedTransfer::SolvedTransfer(const HierarchicalOperator& form_factors,
                               std::optional<HierarchicalMatrix> coarse, const PatchTable& patches,
                               double residual)
    : form_factors_(form_factors.storage()), coarse_(std::move(coarse)), residual_(residual) {
  if (coarse_ && !std::ranges::equal(coarse_->patch(), patch()))
    throw Error("coarse form factors: their patches are in another order than those of all");
  const std::uint32_t count = distinct_channels(patches.reflectance, channel_matrix_);
  for (std::uint32_t m = 0; m < count; ++m) {
    const auto channel = std::ranges::find(channel_matrix_, m) - channel_matrix_.begin();
    Eigen::VectorXf& root = root_.emplace_back(Eigen::VectorXf::Zero(position_count()));
    for (std::size_t k = 0; k < patches.size(); ++k) {
      root[static_cast<Index>(k)] = std::sqrt(patches.reflectance[patch()[k]][channel]);
    }
    leading_.push_back(find_leading(root, m > 0 ? &leading_.back() : nullptr));
  }
}

SolvedTransfer::SolvedTransfer(const HierarchicalOperator& form_factors, const PatchTable& patches,
                               double residual)
    : SolvedTransfer(form_factors, std::optional<HierarchicalMatrix>(), patches, residual) {}

SolvedTransfer::SolvedTransfer(const HierarchicalOperator& form_factors,
                               const HierarchicalStorage& coarse, const PatchTable& patches,
                               double residual)
    : SolvedTransfer(form_factors, std::make_optional<HierarchicalMatrix>(coarse), patches,
                     residual) {}

/// By subspace iteration, from those of another matrix if there is one.
SolvedTransfer::Leading SolvedTransfer::find_leading(const Eigen::VectorXf& root,
                                                     const Leading* other) const {
  load_blas();
  const auto n = static_cast<Index>(patch().size());
  const Index count = std::clamp<Index>(n / kLeadingPart, 1, kLeadingCount);
  Leading leading;
  if (other != nullptr) {
    leading.vectors = other->vectors;
  } else {
    std::mt19937_64 engine(2);
    leading.vectors = Vectors::NullaryExpr(position_count(), count, [&] { return sign(engine); });
  }
  for (int step = other == nullptr ? 0 : kLeadingSteps - kFurtherSteps;; ++step) {
    leading.vectors = orthonormal_columns_of_tall(MatrixXf(root.asDiagonal() * leading.vectors));
    const bool last = step == kLeadingSteps;
    leading.gathered =
        gather_all(last ? form_factors_ : of_steps(), root.asDiagonal() * leading.vectors);
    if (last) break;
    leading.vectors = leading.gathered;
  }
  const MatrixXf kept =
      leading.vectors.transpose() * (leading.vectors - root.asDiagonal() * leading.gathered);
  leading.system.compute(kept.cast<double>());
  if (leading.system.info() != Eigen::Success) refuse();
  return leading;
}

void SolvedTransfer::solve_leading(std::uint32_t matrix, Workspace& workspace) const {
  const Leading& leading = leading_[matrix];
  Vectors& r = workspace.residual;
  const MatrixXf seen = leading.vectors.transpose() * r;
  const Vectors part = leading.system.solve(seen.cast<double>()).cast<float>();
  Vectors& gathered = workspace.arrived;
  gathered.noalias() = leading.gathered * part;
  workspace.solution += gathered;
  r += root_[matrix].asDiagonal() * gathered;
  r.noalias() -= leading.vectors * part;
}

void SolvedTransfer::solve(std::uint32_t matrix, Workspace& workspace) const {
  const Eigen::VectorXf& root = root_[matrix];
  Vectors &y = workspace.solution, &r = workspace.residual, &p = workspace.direction;
  Vectors &sent = workspace.sent, &arrived = workspace.arrived;
  const Index rows = workspace.first.rows(), width = workspace.first.cols();
  const auto squares = [&](const Vectors& v) {
    return column_sums(rows, width, [&](Index i) { return v.row(i).array().square(); });
  };
  y.setZero(workspace.first.rows(), workspace.first.cols());
  r.noalias() = root.asDiagonal() * workspace.first;
  const Sums allowed = residual_ * residual_ * squares(r);
  solve_leading(matrix, workspace);
  p = r;
  sent.noalias() = root.asDiagonal() * p;
  Sums rr = squares(r);
  for (int step = 0; (rr > allowed).any(); ++step) {
    if (step == kMostSteps) refuse();
    of_steps().multiply(0, sent, arrived, workspace.products);
    const Sums pq = column_sums(rows, width, [&](Index i) {
      return p.row(i).array().square() - sent.row(i).array() * arrived.row(i).array();
    });
    // A solution that is good enough stays as it is.
    const Factors alpha = (rr > allowed).select(quotient(rr, pq), 0);
    const Sums before = rr;
    rr = column_sums(rows, width, [&](Index i) {
      y.row(i).array() += alpha * arrived.row(i).array();
      r.row(i).array() -= alpha * (p.row(i) - root[i] * arrived.row(i)).array();
      return r.row(i).array().square();
    });
    const Factors beta = quotient(rr, before);
    for (Index i = 0; i < rows; ++i) {
      p.row(i) = r.row(i).array() + beta * p.row(i).array();
      sent.row(i) = root[i] * p.row(i);
    }
  }
}

const Vectors& SolvedTransfer::later_bounces(std::uint32_t matrix, const Vectors& x,
                                             Workspace& workspace) const {
  form_factors_.multiply(0, x, workspace.first, workspace.products);
  solve(matrix, workspace);
  return workspace.solution;
}

MatrixXf SolvedTransfer::multiply(std::uint32_t matrix, const MatrixXf& x) const {
  load_blas();
  const Ranks ranks;
  MatrixXf result(x.rows(), x.cols());
  const Index groups = (x.cols() + kSmallGroup - 1) / kSmallGroup;
  parallel_loop(static_cast<std::size_t>(groups), [&](std::size_t group) {
    if (!ranks.makes(group)) return;
    const Index begin = static_cast<Index>(group) * kSmallGroup;
    const Index width = std::min(kSmallGroup, x.cols() - begin);
    Vectors in = Vectors::Zero(position_count(), width);
    Workspace workspace;
    for (std::size_t k = 0; k < patch().size(); ++k) {
      in.row(static_cast<Index>(k)) = x.row(patch()[k]).segment(begin, width);
    }
    form_factors_.multiply(0, in, workspace.first, workspace.products);
    solve(matrix, workspace);
    for (std::size_t k = 0; k < patch().size(); ++k) {
      const auto row = static_cast<Index>(k);
      result.row(patch()[k]).segment(begin, width) =
          workspace.first.row(row) + workspace.solution.row(row);
    }
  });
  share_groups(ranks, result);
  return result;
}

std::vector<std::vector<Float3>> SolvedTransfer::indirect_irradiances(
    std::span<const std::vector<Float3>> initial_exitances) const {
  const std::size_t n = patch().size(), count = initial_exitances.size();
  std::vector<float> root(area().begin(), area().end());
  for (float& r : root) r = std::sqrt(r);
  std::vector<std::vector<Float3>> result(count, std::vector<Float3>(n));
  for (std::uint32_t m = 0; m < matrix_count(); ++m) {
    std::vector<int> channels;
    for (int c = 0; c < kChannelCount; ++c) {
      if (channel_matrix_[c] == m) channels.push_back(c);
    }
    MatrixXf columns(n, channels.size() * count);
    const auto for_each_column = [&](const auto& visit) {
#pragma omp parallel for schedule(static)
      for (std::size_t column = 0; column < channels.size() * count; ++column) {
        float* const values = columns.col(static_cast<Index>(column)).data();
        for (std::size_t i = 0; i < n; ++i) {
          visit(column % count, channels[column / count], i, values[i]);
        }
      }
    };
    for_each_column([&](std::size_t light, int c, std::size_t i, float& value) {
      value = root[i] * initial_exitances[light][i][c];
    });
    columns = multiply(m, columns);
    for_each_column([&](std::size_t light, int c, std::size_t i, float value) {
      result[light][i][c] = value / root[i];
    });
  }
  return result;
}

Eigen::VectorXd SolvedTransfer::estimated_energies(const PatchRoles& roles) const {
  const auto n = static_cast<Index>(patch().size());
  std::mt19937_64 engine(1);
  Eigen::VectorXd energies = Eigen::VectorXd::Zero(n);
  for (std::uint32_t m = 0; m < matrix_count(); ++m) {
    MatrixXf signs = MatrixXf::NullaryExpr(n, kProbeCount, [&] { return sign(engine); });
    for (Index i = 0; i < n; ++i) {
      if (!roles.is_receiver(static_cast<std::size_t>(i))) signs.row(i).setZero();
    }
    energies += multiply(m, signs).cast<double>().rowwise().squaredNorm() / kProbeCount;
  }
  return energies;
}

}  // namespace rebounce

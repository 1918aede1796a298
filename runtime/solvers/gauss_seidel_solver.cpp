#include "rebounce/runtime/gauss_seidel_solver.h"

#include <algorithm>
#include <cmath>

namespace rebounce {
namespace {

constexpr std::size_t kGroup = FormFactorBlocks::kGroup;

}  // namespace

GaussSeidelSolver::GaussSeidelSolver(const FormFactorBlocks& form_factors,
                                     const RadiosityProblem& problem, SweepOrder order)
    : RadiositySolver(form_factors, problem),
      blocks_(form_factors),
      order_(order),
      planes_(kChannelCount * form_factors.plane_size()),
      outside_(kGroup) {}

void GaussSeidelSolver::begin(bool /*cold*/) {
  blocks_.to_planes(radiosity_, planes_);
  backward_ = false;
}

void GaussSeidelSolver::finish() {
  blocks_.from_planes(planes_, radiosity_);
}

RadiositySolver::SweepReport GaussSeidelSolver::sweep() {
  const std::size_t n = patch_count(), group_count = (n + kGroup - 1) / kGroup;
  double changed_squared = 0;
#pragma omp parallel
  for (std::size_t k = 0; k < group_count; ++k) {
    const std::size_t group = backward_ ? group_count - 1 - k : k;
    const std::size_t begin = group * kGroup, end = std::min(begin + kGroup, n);
    gather_from_outside(begin, end);
#pragma omp single
    changed_squared += relax_group(begin, end);
  }
  if (order_ == SweepOrder::kSymmetric) backward_ = !backward_;
  // A row's change is its residual when it is reached; what is left after the sweep is rho times
  // one triangle of F times the change.
  return {.residual = std::sqrt(changed_squared)};
}

void GaussSeidelSolver::gather_from_outside(std::size_t group_begin, std::size_t group_end) {
#pragma omp for schedule(dynamic, 16)
  for (std::size_t i = group_begin; i < group_end; ++i) {
    outside_[i - group_begin] = blocks_.gather_outside_group(i, planes_);
  }
}

double GaussSeidelSolver::relax_group(std::size_t group_begin, std::size_t group_end) {
  double changed_squared = 0;
  if (backward_) {
    for (std::size_t i = group_end; i-- > group_begin;) changed_squared += relax_row(i);
  } else {
    for (std::size_t i = group_begin; i < group_end; ++i) changed_squared += relax_row(i);
  }
  return changed_squared;
}

double GaussSeidelSolver::relax_row(std::size_t row) {
  const std::size_t stride = blocks_.plane_size();
  const Float3& outside = outside_[row % kGroup];
  const Float3 inside = blocks_.gather_inside_group(row, planes_);
  double changed_squared = 0;
  for (int c = 0; c < kChannelCount; ++c) {
    float& radiosity = planes_[c * stride + row];
    const float next = initial_exitance_[row][c] + reflectance_[row][c] * (outside[c] + inside[c]);
    const double change = static_cast<double>(next) - radiosity;
    changed_squared += area_[row] * change * change;
    radiosity = next;
  }
  return changed_squared;
}

}  // namespace rebounce

#include "rebounce/precompute/reference_solution.h"

#include <cmath>

#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

constexpr int kMaxSweeps = 10000;

}  // namespace

ReferenceSolver::ReferenceSolver(const ExchangeMatrix& exchange, const PatchTable& patches)
    : patches_(patches), rows_(exchange, patches.area) {}

ReferenceSolver::Double3 ReferenceSolver::gather_row(std::size_t row,
                                                     const std::vector<Double3>& radiosity) const {
  const auto columns = rows_.columns(row);
  const auto factors = rows_.form_factors(row);
  Double3 sum{0, 0, 0};
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const Double3& b = radiosity[columns[k]];
    const double f = factors[k];
    for (int c = 0; c < kChannelCount; ++c) sum[c] += f * b[c];
  }
  return sum;
}

std::vector<ReferenceSolver::Double3> ReferenceSolver::radiosity(
    std::span<const Float3> initial_exitance, double residual) const {
  const std::size_t n = patches_.size();
  std::vector<Double3> b(n);
  double norm = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      b[i][c] = initial_exitance[i][c];
      norm += patches_.area[i] * b[i][c] * b[i][c];
    }
  }
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    // What a sweep changes a row by is that row's residual at the time.
    double changed = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Double3 h = gather_row(i, b);
      for (int c = 0; c < kChannelCount; ++c) {
        const double next = initial_exitance[i][c] + patches_.reflectance[i][c] * h[c];
        changed += patches_.area[i] * (next - b[i][c]) * (next - b[i][c]);
        b[i][c] = next;
      }
    }
    if (changed <= residual * residual * norm) return b;
  }
  throw Error("the reference solution did not converge in " + std::to_string(kMaxSweeps) +
              " sweeps; a reflectance must be too close to 1");
}

std::vector<Float3> ReferenceSolver::indirect_irradiance(std::span<const Float3> initial_exitance,
                                                         double residual) const {
  const std::vector<Double3> b = radiosity(initial_exitance, residual);
  std::vector<Float3> h(b.size());
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t i = 0; i < b.size(); ++i) {
    const Double3 sum = gather_row(i, b);
    for (int c = 0; c < kChannelCount; ++c) h[i][c] = static_cast<float>(sum[c]);
  }
  return h;
}

}  // namespace rebounce

#include "runtime/solvers/radiosity_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rebounce/error.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/argument_check.h"
#include "transfer/base/finite_values.h"

namespace rebounce {
namespace {

/// A solve stops after this many sweeps without improvement: it has reached the limit of single
/// precision.
constexpr int kPatience = 8;

/// A restart from the measured residual is not worth another one if it gains less than this factor.
constexpr double kWorthwhileRestart = 0.5;

}  // namespace

RadiositySolver::RadiositySolver(const FormFactorOperator& form_factors,
                                 const RadiosityProblem& problem)
    : form_factors_(form_factors), area_(problem.area.begin(), problem.area.end()) {
  const std::size_t n = form_factors.patch_count();
  if (area_.size() != n) throw Error("solver: form factors and patch areas differ in number");
  set_reflectance(problem.reflectance);
  radiosity_.resize(n);
  residual_.resize(n);
  gather_workspace_.resize(form_factors.workspace_size());
}

void RadiositySolver::set_reflectance(std::span<const Float3> reflectance) {
  if (reflectance.size() != area_.size()) {
    throw Error("solver: reflectances and patches differ in number");
  }
  float largest = 0;
  for (const Float3& rho : reflectance) {
    for (const float x : rho) {
      if (!(x >= 0 && x < 1)) throw Error("solver: a reflectance is not in [0, 1)");
      largest = std::max(largest, x);
    }
  }
  reflectance_.assign(reflectance.begin(), reflectance.end());
  max_reflectance_ = largest;
}

void RadiositySolver::start_from(std::span<const Float3> radiosity) {
  if (radiosity.size() != radiosity_.size()) {
    throw Error("solver: the radiosity to start from must have one entry per patch");
  }
  for (const Float3& b : radiosity) {
    if (!std::ranges::all_of(b, [](float x) { return std::isfinite(x); })) {
      throw Error("solver: the radiosity to start from is not finite");
    }
  }
  std::ranges::copy(radiosity, radiosity_.begin());
  cold_ = false;
}

void RadiositySolver::reset() {
  std::ranges::fill(radiosity_, Float3{0, 0, 0});
  cold_ = true;
}

double RadiositySolver::compute_residual() {
  form_factors_.gather(radiosity_, residual_, gather_workspace_, scheduler_);
  for (std::size_t i = 0; i < residual_.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      residual_[i][c] =
          (initial_exitance_[i][c] - radiosity_[i][c]) + reflectance_[i][c] * residual_[i][c];
    }
  }
  return area_norm(residual_, area_);
}

void RadiositySolver::check(std::span<const Float3> initial_exitance,
                            const SolveSettings& settings) const {
  if (initial_exitance.size() != area_.size()) {
    throw Error("solver: the initial exitance must have one entry per patch");
  }
  check_light_of_patches("solver: the initial exitance", initial_exitance);
  if (settings.max_sweeps < 1) throw Error("solver: max_sweeps must be at least 1");
  if (!(settings.residual >= 0)) throw Error("solver: the residual must not be negative");
  if (!(settings.time_budget_microseconds >= 0)) {
    throw Error("solver: the time budget must not be negative");
  }
}

void RadiositySolver::refuse_if_not_finite(const SolveResult& result) {
  const std::span<const float> channels(reinterpret_cast<const float*>(radiosity_.data()),
                                        kChannelCount * radiosity_.size());
  if (std::isfinite(result.residual) && are_finite(channels)) return;
  reset();
  throw Error(
      "solver: the solution is not finite; give less light, or take another method if it diverges");
}

SolveResult RadiositySolver::solve(std::span<const Float3> initial_exitance,
                                   const SolveSettings& settings) {
  const Clock::time_point start = Clock::now();
  check(initial_exitance, settings);
  initial_exitance_ = initial_exitance;
  scheduler_ = settings.scheduler;
  deadline_ = Clock::time_point::max();
  if (settings.time_budget_microseconds > 0) {
    const std::chrono::duration<double, std::micro> budget(settings.time_budget_microseconds);
    // A budget of an hour or more means no limit.
    if (budget < std::chrono::hours(1)) {
      deadline_ = start + std::chrono::duration_cast<Clock::duration>(budget);
    }
  }
  const SolveResult result = iterate(settings, start);
  initial_exitance_ = {};
  refuse_if_not_finite(result);
  return result;
}

SolveResult RadiositySolver::solve(std::span<const Float3> initial_exitance,
                                   const SolveSettings& settings, std::span<Float3> radiosity) {
  if (radiosity.size() != radiosity_.size()) {
    throw Error("solver: the radiosity must have one entry per patch");
  }
  const SolveResult result = solve(initial_exitance, settings);
  std::ranges::copy(radiosity_, radiosity.begin());
  return result;
}

bool RadiositySolver::monitor_ends() {
  if (!monitor_) return false;
  finish();
  return !monitor_(radiosity_);
}

SolveResult RadiositySolver::iterate(const SolveSettings& settings, Clock::time_point start) {
  SolveResult result;
  const double norm = area_norm(initial_exitance_, area_);
  if (norm == 0) {
    reset();
    result.converged = true;
    return result;
  }
  if (cold_) std::ranges::copy(initial_exitance_, radiosity_.begin());
  begin(std::exchange(cold_, false));

  const auto stop_clock = [&] {
    finish();
    const std::chrono::duration<double, std::micro> time = Clock::now() - start;
    result.microseconds = time.count();
  };
  double best = std::numeric_limits<double>::infinity(), confirmed = best;
  int since_best = 0;
  while (true) {
    const SweepReport report = sweep();
    ++result.sweeps;
    result.residual = report.residual / norm;
    result.diverged = report.diverged;
    since_best = result.residual < best ? 0 : since_best + 1;
    best = std::min(best, result.residual);
    const bool there = settings.residual > 0 && result.residual <= settings.residual;
    const bool last = monitor_ends() || report.stuck || report.diverged ||
                      result.sweeps >= settings.max_sweeps || Clock::now() >= deadline_ ||
                      (settings.residual > 0 && since_best >= kPatience);
    if (!there && !last) continue;

    stop_clock();
    if (report.measured || !settings.measure_residual) break;
    result.residual = compute_residual() / norm;
    if (last || result.residual <= settings.residual ||
        result.residual > kWorthwhileRestart * confirmed) {
      break;
    }
    // The bound was reached but the residual is larger: continue from the measured residual.
    confirmed = result.residual;
    best = std::numeric_limits<double>::infinity();
    since_best = 0;
    begin(false);
  }
  result.converged =
      !result.diverged && settings.residual > 0 && result.residual <= settings.residual;
  return result;
}

}  // namespace rebounce

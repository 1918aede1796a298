#include "bench/support/timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace rebounce::bench {
namespace {

/// The part `part` of the way through sorted samples, interpolated.
double quantile(const std::vector<double>& sorted, double part) {
  const double at = part * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], at - static_cast<double>(below));
}

int runs_per_sample(const TimedCase& timed, double sample_seconds) {
  constexpr double kMostRuns = 1e5;
  if (timed.prepare && !timed.repeat_prepared) return 1;
  if (timed.prepare) timed.prepare();
  const double seconds = std::max(seconds_of(timed.work), 1e-9);
  return static_cast<int>(std::clamp(std::ceil(sample_seconds / seconds), 1.0, kMostRuns));
}

/// The median of runs that are each prepared.
double prepared_sample(const TimedCase& timed, int runs) {
  std::vector<double> seconds;
  for (int run = runs > 1 ? -1 : 0; run < runs; ++run) {
    timed.prepare();
    const double taken = seconds_of(timed.work);
    if (run >= 0) seconds.push_back(taken);
  }
  return summarise(std::move(seconds)).median;
}

double sample(const TimedCase& timed, int runs) {
  if (timed.prepare) return prepared_sample(timed, runs);
  if (runs > 1) timed.work();
  return seconds_of([&] {
           for (int run = 0; run < runs; ++run) timed.work();
         }) /
         runs;
}

}  // namespace

double seconds_of(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Timing summarise(std::vector<double> samples) {
  std::ranges::sort(samples);
  const double median = quantile(samples, 0.5);
  return {median, (quantile(samples, 0.75) - quantile(samples, 0.25)) / median, samples.front()};
}

std::vector<Timing> time_interleaved(std::span<const TimedCase> cases,
                                     const InterleavingSettings& settings) {
  std::vector<int> runs;
  runs.reserve(cases.size());
  for (const TimedCase& timed : cases) {
    sample(timed, 1);
    runs.push_back(runs_per_sample(timed, settings.sample_seconds));
  }
  std::vector<std::vector<double>> samples(cases.size());
  for (int round = 0; round < settings.rounds; ++round) {
    for (std::size_t k = 0; k < cases.size(); ++k) {
      samples[k].push_back(sample(cases[k], runs[k]));
    }
  }
  std::vector<Timing> timings;
  timings.reserve(cases.size());
  for (std::vector<double>& of_case : samples) timings.push_back(summarise(std::move(of_case)));
  return timings;
}

}  // namespace rebounce::bench

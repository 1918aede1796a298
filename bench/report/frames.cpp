#include "bench/report/frames.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "bench/report/in_parallel.h"
#include "bench/support/reflected_light.h"
#include "rebounce/error.h"
#include "runtime/frame/direct_lighting.h"
#include "transfer/base/reflection.h"

namespace rebounce::bench {
namespace {

constexpr double kPercent = 0.01, kPermille = 0.001;

// A residual below which sweeps of a frame that are left would change nothing that is seen.
constexpr double kConvergedResidual = 1e-6;

/// The light of one path: M0 and B [n] in lx of each frame.
struct LitFrames {
  std::vector<std::vector<Float3>> initial_exitance, truth;
};

LitFrames light_frames(const Contenders& contenders, const LightPath& path,
                       DirectLighting& direct) {
  const TransferData& data = *contenders.data;
  std::vector<float> workspace(data.transfer->workspace_size());
  LitFrames lit;
  for (const std::vector<Light>& lights : path.frames) {
    std::vector<Float3> exitance(data.patches.size()), radiosity(data.patches.size());
    direct.compute(lights, {}, exitance);
    reflect(data.patches.reflectance, exitance);
    data.transfer->apply(exitance, radiosity, workspace);
    add_reflected(exitance, data.patches.reflectance, radiosity, radiosity);
    lit.initial_exitance.push_back(std::move(exitance));
    lit.truth.push_back(std::move(radiosity));
  }
  return lit;
}

/// A contestant with a number of sweeps, and the budgets that this is the most for.
struct Run {
  std::size_t contestant = 0;
  int sweeps = 0;
  std::vector<double> budgets{};
};

std::vector<Run> list_runs(const std::vector<RunTime>& times, const std::vector<double>& budgets) {
  std::vector<Run> runs;
  for (std::size_t k = 0; k < times.size(); ++k) {
    for (const double budget : budgets) {
      const int sweeps = times[k].sweeps_within(budget);
      const bool same =
          !runs.empty() && runs.back().contestant == k && runs.back().sweeps == sweeps;
      if (!same) runs.push_back({.contestant = k, .sweeps = sweeps});
      runs.back().budgets.push_back(budget);
    }
  }
  return runs;
}

/// Follows a path. In the frame of a switch what iterates goes on from the frame before or starts
/// in the dark, whichever is nearer to the truth after its sweeps.
std::vector<float> follow(const LitFrames& lit, const std::vector<int>& switches, int sweeps,
                          std::span<const float> area, Method& method) {
  method.start_from(lit.truth.front());
  std::vector<float> errors;
  for (std::size_t frame = 0; frame < lit.truth.size(); ++frame) {
    const auto run = [&] {
      method.run(lit.initial_exitance[frame], sweeps, kConvergedResidual);
      return static_cast<float>(
          reflected_error(method.radiosity(), lit.truth[frame], lit.initial_exitance[frame], area));
    };
    errors.push_back(run());
    if (!method.iterates() || !std::ranges::binary_search(switches, static_cast<int>(frame)))
      continue;
    const std::vector<Float3> from_before(method.radiosity().begin(), method.radiosity().end());
    method.reset();
    const float from_dark = run();
    if (from_dark >= errors.back()) method.start_from(from_before);
    errors.back() = std::min(errors.back(), from_dark);
  }
  return errors;
}

void summarise(const LightPath& path, FrameRow& row) {
  std::vector<float> sorted = row.errors;
  std::ranges::sort(sorted);
  row.error_mean = std::accumulate(sorted.begin(), sorted.end(), 0.0) / sorted.size();
  row.error_p95 = sorted[static_cast<std::size_t>(std::ceil(0.95 * sorted.size())) - 1];
  row.error_worst = sorted.back();
  if (path.switches.empty()) return;
  row.lag_percent = lag_after(path.switches, row.errors, kPercent);
  row.lag_permille = lag_after(path.switches, row.errors, kPermille);
}

}  // namespace

Lag lag_after(const std::vector<int>& switches, const std::vector<float>& errors,
              double threshold) {
  Lag lag;
  for (std::size_t k = 0; k < switches.size(); ++k) {
    const int end = k + 1 < switches.size() ? switches[k + 1] : static_cast<int>(errors.size());
    int frame = switches[k];
    while (frame < end && errors[frame] > threshold) ++frame;
    if (frame == end) ++lag.never;
    const int frames = frame - switches[k];
    lag.mean += static_cast<double>(frames) / static_cast<double>(switches.size());
    lag.worst = std::max(lag.worst, frames);
  }
  return lag;
}

std::vector<FrameRow> measure_frames(const Contenders& contenders,
                                     const std::vector<Contestant>& contestants,
                                     const std::vector<RunTime>& times, double truth_error,
                                     const ReportSettings& settings,
                                     const ReportProgress& progress) {
  const TransferData& data = *contenders.data;
  const std::vector<LightPath> paths =
      make_light_paths(data, *contenders.tracer, settings.frame_count, settings.seed);
  const std::vector<Run> runs = list_runs(times, settings.budgets);
  DirectLighting direct(data, *contenders.tracer);
  std::vector<FrameRow> rows;
  for (std::size_t p = 0; p < paths.size(); ++p) {
    const Progress part = [&](double done) {
      return progress("light paths", (static_cast<double>(p) + done) / paths.size());
    };
    const LitFrames lit = light_frames(contenders, paths[p], direct);
    std::vector<std::vector<FrameRow>> of_run(runs.size());
    const auto errors_of = [&](const Contestant& contestant, int sweeps) {
      if (contestant.name == kDenseInverse) {
        return std::vector<float>(lit.truth.size(), static_cast<float>(truth_error));
      }
      return follow(lit, paths[p].switches, sweeps, data.patches.area,
                    *contestant.make(contenders));
    };
    in_parallel(runs.size(), part, [&](std::size_t k) {
      FrameRow row{
          .path = paths[p].name, .contestant = runs[k].contestant, .sweeps = runs[k].sweeps};
      if (row.sweeps > 0) {
        row.errors = errors_of(contestants[row.contestant], row.sweeps);
        summarise(paths[p], row);
      }
      for (const double budget : runs[k].budgets) {
        of_run[k].push_back(row);
        of_run[k].back().budget = budget;
      }
    });
    for (auto& some : of_run) std::ranges::move(some, std::back_inserter(rows));
  }
  return rows;
}

}  // namespace rebounce::bench

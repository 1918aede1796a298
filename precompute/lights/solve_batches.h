#pragma once

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/ranks.h"
#include "precompute/lights/reference_solution.h"

namespace rebounce {

/// Returns the indirect irradiances [n] in lx of some lights, given as initial exitances [n] in lx.
/// All ranks call it together.
using IrradiancesOf =
    std::function<std::vector<std::vector<Float3>>(std::span<const std::vector<Float3>>)>;

/// What `solve` makes of `lights`, by batches of ReferenceSolver::kBatchLights: a span of lights
/// in, as many vectors of Float3 out. Ranks share the batches. Throws Cancelled if asked to stop.
template <typename Solve>
std::vector<std::vector<Float3>> solve_batches(std::span<const std::vector<Float3>> lights,
                                               const Progress& progress, const Solve& solve) {
  constexpr std::size_t kBatch = ReferenceSolver::kBatchLights;
  const Ranks ranks;
  std::vector<std::vector<Float3>> solutions(lights.size());
  for (std::size_t begin = 0; begin < lights.size(); begin += kBatch) {
    report_progress(progress, static_cast<double>(begin) / static_cast<double>(lights.size()));
    if (!ranks.makes(begin, kBatch)) continue;
    auto some = solve(lights.subspan(begin, std::min(kBatch, lights.size() - begin)));
    std::ranges::move(some, solutions.begin() + static_cast<std::ptrdiff_t>(begin));
  }
  ranks.share(std::span(solutions), kBatch);
  return solutions;
}

}  // namespace rebounce

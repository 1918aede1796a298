#include "precompute/lights/corrected_solver.h"

#include <algorithm>
#include <array>
#include <utility>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/ranks.h"
#include "precompute/lights/reference_solution.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/light_sum.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

// Rounds after which a light is left to ReferenceSolver: each usually leaves a hundredth of the
// error, with compressed form factors a thousandth. The residual that it solves to where nearly no
// light arrives, relative to what is emitted.
constexpr int kMostRounds = 4;
constexpr double kLeastResidual = 1e-10;

// Lights that one gather along the links takes: their sums just fill the registers.
constexpr std::size_t kGathered = 8, kColumns = kGathered * kChannelCount;

}  // namespace

CorrectedSolver::Lights indirect_irradiances(
    const TransferOperator& transfer, std::span<const std::vector<Float3>> initial_exitances) {
  CorrectedSolver::Lights light;
  for (const auto& m0 : initial_exitances) light.emplace_back(m0.size());
  parallel_loop(
      light.size(), 1, [&] { return std::vector<float>(transfer.workspace_size()); },
      [&](std::size_t k, std::vector<float>& workspace) {
        transfer.apply(initial_exitances[k], light[k], workspace);
      });
  return light;
}

/// F times radiosities, along the links.
CorrectedSolver::Lights CorrectedSolver::gather(const Lights& radiosities) const {
  using Columns = std::array<float, kColumns>;
  const std::size_t n = patches_.size();
  const Ranks ranks;
  Lights gathered(radiosities.size());
  GatheredLights<Columns> lights;
  lights.in.resize(n);
  for (std::size_t begin = 0; begin < radiosities.size(); begin += kGathered) {
    if (!ranks.makes(begin, kGathered)) continue;
    const std::size_t count = std::min(kGathered, radiosities.size() - begin);
    for (std::size_t i = 0; i < n; ++i) {
      lights.in[i] = {};
      for (std::size_t k = 0; k < count; ++k) {
        std::ranges::copy(radiosities[begin + k][i], lights.in[i].begin() + k * kChannelCount);
      }
    }
    links_->gather(lights);
    for (std::size_t k = 0; k < count; ++k) {
      std::vector<Float3>& light = gathered[begin + k];
      light.resize(n);
      for (std::size_t i = 0; i < n; ++i) {
        std::copy_n(lights.out[i].begin() + k * kChannelCount, kChannelCount, light[i].begin());
      }
    }
  }
  ranks.share(std::span(gathered), kGathered);
  return gathered;
}

CorrectedSolver::Lights CorrectedSolver::indirect_irradiances(
    std::span<const std::vector<Float3>> initial_exitances, const Accuracy& accuracy) const {
  Lights result = nearly_exact_(initial_exitances);
  std::vector<Open> open;
  for (std::size_t k = 0; k < result.size(); ++k) {
    open.push_back({k, area_norm(result[k], patches_.area), 0});
  }
  for (int round = 0; round < kMostRounds && !open.empty(); ++round) {
    const Lights corrected = correct(initial_exitances, result, open);
    std::vector<Open> left;
    for (std::size_t k = 0; k < open.size(); ++k) {
      std::vector<Float3>& light = result[open[k].light];
      add_to(light, corrected[k], -1);
      const double change = area_norm(light, patches_.area);
      light = corrected[k];
      const double guess_error = round == 0 ? change : open[k].guess_error;
      const double allowed = std::max(accuracy.of_light * area_norm(light, patches_.area),
                                      accuracy.of_guess * guess_error);
      // What is left is the same part of this change as it is of the last one.
      if (change * change > allowed * open[k].last_change) {
        left.push_back({open[k].light, change, guess_error});
      }
    }
    open = std::move(left);
  }
  solve_along_links(initial_exitances, open, accuracy.of_light, result);
  return result;
}

/// The irradiances of the lights that are `open`, after one more round.
CorrectedSolver::Lights CorrectedSolver::correct(
    std::span<const std::vector<Float3>> initial_exitances, const Lights& irradiances,
    std::span<const Open> open) const {
  // H = F (M0 + rho H). With h = F (M0 + rho H0) and d = h - H0, H = h + Y rho d.
  Lights radiosities;
  for (const Open& o : open) {
    std::vector<Float3>& b = radiosities.emplace_back(irradiances[o.light]);
    reflect(patches_.reflectance, b);
    add_to(b, initial_exitances[o.light]);
  }
  Lights result = gather(radiosities);
  Lights& reflected = radiosities;
  for (std::size_t k = 0; k < open.size(); ++k) {
    reflected[k] = result[k];
    add_to(reflected[k], irradiances[open[k].light], -1);
    reflect(patches_.reflectance, reflected[k]);
  }
  const Lights corrections = nearly_exact_(reflected);
  for (std::size_t k = 0; k < open.size(); ++k) add_to(result[k], corrections[k]);
  return result;
}

void CorrectedSolver::solve_along_links(std::span<const std::vector<Float3>> initial_exitances,
                                        std::span<const Open> open, double residual,
                                        Lights& irradiances) const {
  if (open.empty()) return;
  Lights left;
  for (const Open& o : open) left.push_back(initial_exitances[o.light]);
  const ReferenceSolver solver(links_, patches_);
  Lights solved = solve_batches(left, {}, [&](std::span<const std::vector<Float3>> some) {
    return solver.indirect_irradiances(some, kLeastResidual, residual);
  });
  for (std::size_t k = 0; k < open.size(); ++k) irradiances[open[k].light] = std::move(solved[k]);
}

}  // namespace rebounce

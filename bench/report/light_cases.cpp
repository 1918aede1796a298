#include "bench/report/light_cases.h"

#include <algorithm>

#include "bench/report/in_parallel.h"
#include "bench/support/light_changes.h"
#include "precompute/lights/reference_solution.h"
#include "rebounce/error.h"
#include "runtime/solvers/solve_radiosity.h"

namespace rebounce::bench {
namespace {

constexpr float kRepaint = 0.5F;
constexpr double kReferenceResidual = 1e-10;

/// For each patch whether it is repainted: whether its first triangle is of the material that most
/// of the surface is of.
std::vector<bool> repainted_patches(const TransferData& data) {
  const std::size_t n = data.patches.size();
  std::vector<std::uint32_t> material(n, kNone);
  for (std::size_t t = data.mesh.triangle.size(); t-- > 0;) {
    const std::uint32_t patch = data.mesh.triangle_patch[t];
    if (patch != kNone) material[patch] = data.mesh.triangle_material[t];
  }
  std::vector<double> area(data.materials.size(), 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    if (material[i] != kNone) area[material[i]] += data.patches.area[i];
  }
  const auto most = static_cast<std::uint32_t>(std::ranges::max_element(area) - area.begin());
  std::vector<bool> repainted(n);
  for (std::size_t i = 0; i < n; ++i) repainted[i] = material[i] == most;
  return repainted;
}

/// The light of a cold start, with surfaces repainted.
LightCase repaint(const LightCase& lit, const std::vector<bool>& painted) {
  LightCase result{kRepainted, false, lit.after, lit.reflectance, {}};
  for (std::size_t i = 0; i < painted.size(); ++i) {
    for (int c = 0; c < kChannelCount && painted[i]; ++c) {
      result.after[i][c] *= kRepaint;
      result.reflectance[i][c] *= kRepaint;
    }
  }
  return result;
}

void solve_truths(const TransferData& data, std::vector<LightCase>& cases,
                  const ReportProgress& progress) {
  PatchTable repainted = data.patches;
  const auto found = std::ranges::find(cases, kRepainted, &LightCase::change);
  if (found != cases.end()) repainted.reflectance = found->reflectance;
  const ReferenceSolver usual(data.exchange, data.patches), other(data.exchange, repainted);
  for (std::size_t k = 0, end = 0; k < cases.size(); k = end) {
    if (!progress("reference", static_cast<double>(k) / static_cast<double>(cases.size()))) {
      throw Cancelled();
    }
    std::vector<std::vector<Float3>> lights;
    while (end < cases.size() && cases[end].change == cases[k].change &&
           lights.size() < ReferenceSolver::kBatchLights) {
      lights.push_back(cases[end++].after);
    }
    const ReferenceSolver& solver = cases[k].change == kRepainted ? other : usual;
    const auto truths = solver.radiosities(lights, kReferenceResidual);
    for (std::size_t l = 0; l < lights.size(); ++l) cases[k + l].truth = rounded(truths[l]);
  }
}

}  // namespace

std::vector<LightCase> make_light_cases(const Contenders& contenders,
                                        const ReportSettings& settings,
                                        const ReportProgress& progress) {
  const TransferData& data = *contenders.data;
  const std::vector<bool> painted = repainted_patches(data);
  std::vector<LightCase> cases;
  for (int lamp = 0; lamp < settings.lamp_count; ++lamp) {
    const auto changes = light_changes(data, settings.motions, settings.seed + lamp,
                                       kLampTypes[lamp % kLampTypes.size()]);
    for (const LightChange& change : changes) {
      const bool cold = change.before.empty();
      cases.push_back({change.name, cold, change.after, data.patches.reflectance, {}});
    }
    cases.push_back({kSwitched, true, changes.back().after, data.patches.reflectance, {}});
    cases.push_back(repaint(cases[cases.size() - changes.size() - 1], painted));
  }
  // Stable: changes in the order of the first lamp.
  std::vector<LightCase> ordered;
  const std::size_t per_lamp = cases.size() / settings.lamp_count;
  for (std::size_t change = 0; change < per_lamp; ++change) {
    for (std::size_t k = change; k < cases.size(); k += per_lamp) {
      ordered.push_back(std::move(cases[k]));
    }
  }
  solve_truths(data, ordered, progress);
  return ordered;
}

std::vector<std::vector<Float3>> solve_on(const Form& form, const Contenders& contenders,
                                          const std::vector<LightCase>& cases,
                                          const ReportProgress& progress) {
  const bool exact = form.name == kExactRows || form.name == kExactHalf;
  const PatchTable& patches = contenders.data->patches;
  std::vector<std::vector<Float3>> own(cases.size());
  const Progress part = [&](double done) { return progress("own solutions", done); };
  in_parallel(cases.size(), part, [&](std::size_t k) {
    own[k] = cases[k].truth;
    if (exact) return;
    solve_radiosity(SolveMethod::kConjugateGradient, *form.form_factors,
                    {patches.area, cases[k].reflectance}, cases[k].after,
                    {.max_sweeps = 1000, .residual = 1e-7}, own[k]);
  });
  return own;
}

}  // namespace rebounce::bench

#include "bench/build/closed_forms.h"

#include <algorithm>
#include <cmath>

#include "bench/build/known_form_factors.h"
#include "bench/support/named_quality.h"

namespace rebounce::bench {
namespace {

/// F from all patches of material 0 to all of material 1.
double factor_between(const PatchModel& model, const ExchangeMatrix& exchange) {
  std::vector<std::uint32_t> material(model.patches.size());
  for (std::size_t t = 0; t < model.mesh.surface_count(); ++t) {
    const std::uint32_t patch = model.mesh.triangle_patch[t];
    if (patch != kNone) material[patch] = model.mesh.triangle_material[t];
  }
  double exchanged = 0, area = 0;
  for (std::size_t i = 0; i < material.size(); ++i) {
    if (material[i] == 0) area += model.patches.area[i];
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const auto [low, high] = std::minmax({material[i], material[exchange.column[k]]});
      if (low == 0 && high == 1) exchanged += exchange.exchange_area[k];
    }
  }
  return exchanged / area;
}

void measure(const KnownFormFactor& known, std::size_t patch_count, Table& table) {
  const PatchModel model = make_patch_model(known.scene, {.patch_count = patch_count});
  const RayTracer tracer = make_surface_tracer(model.mesh);
  for (const NamedQuality& q : kQualities) {
    if (q.asked_part == 0) continue;
    const FormFactors f = compute_form_factors(model, tracer, with_quality(q.quality));
    const double error = std::abs(factor_between(model, f.exchange) - known.factor);
    const double asked = std::max(q.asked_part * known.factor, q.asked_least);
    table.add({known.name, model.patches.size(), q.name, known.factor, error, error / asked});
  }
}

}  // namespace

Table measure_closed_forms(const std::string& view_factors) {
  constexpr std::size_t kPatches = 200, kPatchesBehindScreens = 600;
  Table table({"configuration", "patches", "quality", "form factor", "error", "of asked"});
  for (const KnownFormFactor& known : tabled_form_factors(view_factors)) {
    measure(known, kPatches, table);
  }
  for (const KnownFormFactor& known : hidden_form_factors()) {
    measure(known, kPatchesBehindScreens, table);
  }
  return table;
}

}  // namespace rebounce::bench

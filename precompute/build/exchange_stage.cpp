#include "precompute/build/exchange_stage.h"

#include <utility>

#include "precompute/exchange/links/link_fitting.h"
#include "precompute/exchange/pairs/form_factors.h"

namespace rebounce {

EscapedLight find_pairs(const PatchModel& model, const RayTracer& tracer,
                        const BuildSettings& decided, TransferData& data, BuildReport& report,
                        PhaseClock& clock) {
  FormFactors form_factors = clock.run("form factors", [&](const Progress& part) {
    return compute_form_factors(model, tracer, decided.form_factors, part);
  });
  report.ray_count = form_factors.ray_count;
  report.pair_count = form_factors.pair_count;
  report.form_factor_count = form_factors.exchange.column.size();
  report.closure = form_factors.closure;
  if (decided.store_links) {
    data.links = clock.run("links", [&](const Progress& part) {
      return fit_links(form_factors.exchange, model.patches, kErrorPerLink, part);
    });
    report.link_count = data.links.pair.size();
  }
  data.exchange = std::move(form_factors.exchange);
  return form_factors;
}

}  // namespace rebounce

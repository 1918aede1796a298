#include "precompute/exchange/pairs/form_factors.h"

#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/raw_exchange.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

class FormFactorAssembly {
 public:
  FormFactorAssembly(const PatchModel& model, const RayTracer& tracer,
                     const FormFactorSettings& settings, const Progress& progress)
      : model_(model),
        tracer_(tracer),
        settings_(settings),
        progress_(progress),
        geometry_(model, tracer),
        shadow_rays_(geometry_, settings.seed, settings.kernel_tolerance) {}

  FormFactors run() const {
    return close(compute_raw_exchange(model_, shadow_rays_, tracer_, settings_, progress_));
  }

  FormFactorForecast forecast() const {
    return forecast_raw_exchange(model_, shadow_rays_, tracer_, settings_, progress_);
  }

 private:
  FormFactors close(RawExchange raw) const {
    FormFactors result;
    result.closure = enforce_closure(raw.rows, geometry_.areas(), raw.target);
    static_cast<EscapedLight&>(result) =
        share_escape(row_sums(raw.rows, geometry_.areas()), raw.escape);
    result.exchange = compress_rows(raw.rows);
    result.ray_count = raw.ray_count;
    result.pair_count = raw.pair_count;
    return result;
  }

  static ExchangeMatrix compress_rows(const ExchangeRows& rows) {
    std::vector<std::uint64_t> row_begin = {0};
    std::vector<std::uint32_t> column;
    std::vector<float> exchange_area;
    std::size_t count = 0;
    for (const auto& row : rows) count += row.size();
    row_begin.reserve(rows.size() + 1);
    column.reserve(count);
    exchange_area.reserve(count);
    for (const auto& row : rows) {
      for (const ExchangeEntry& entry : row) {
        column.push_back(entry.column);
        exchange_area.push_back(entry.exchange_area);
      }
      row_begin.push_back(column.size());
    }
    return {SharedArray(std::move(row_begin)), SharedArray(std::move(column)),
            SharedArray(std::move(exchange_area))};
  }

  const PatchModel& model_;
  const RayTracer& tracer_;
  const FormFactorSettings& settings_;
  const Progress& progress_;
  const PatchGeometry geometry_;
  const ShadowRays shadow_rays_;
};

}  // namespace

FormFactors compute_form_factors(const PatchModel& model, const RayTracer& tracer,
                                 const FormFactorSettings& settings, const Progress& progress) {
  check_form_factor_settings(settings);
  return FormFactorAssembly(model, tracer, settings, progress).run();
}

FormFactorForecast forecast_form_factors(const PatchModel& model, const RayTracer& tracer,
                                         const FormFactorSettings& settings,
                                         const Progress& progress) {
  check_form_factor_settings(settings);
  return FormFactorAssembly(model, tracer, settings, progress).forecast();
}

}  // namespace rebounce

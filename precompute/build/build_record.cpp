#include "precompute/build/build_record.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "precompute/base/json_text.h"

namespace rebounce {
namespace {

const char* name(ExchangeSource kind) {
  return kind == ExchangeSource::kLinks ? "links" : "pairs";
}

bool is_hierarchical(const BuildSettings& settings) {
  return settings.operator_kind == OperatorKind::kHierarchical;
}

/// Those that had a part in the build.
std::string settings_json(const BuildSettings& settings, double form_factor_tolerance) {
  const FormFactorSettings& f = settings.form_factors;
  nlohmann::json json{{"operator", operator_name(settings.operator_kind)},
                      {"form_factors", name(settings.exchange_source)},
                      {"store_form_factors", settings.store_form_factors},
                      {"form_factor_tolerance", form_factor_tolerance},
                      {"receivers", settings.receivers},
                      {"sources", settings.sources},
                      {"scale", settings.scale},
                      {"precision", precision_name(*settings.precision)},
                      {"patches", settings.subdivision.patch_count},
                      {"patch_size", settings.subdivision.patch_size},
                      {"lamp_weight", settings.subdivision.lamp_weight},
                      {"seed", f.seed},
                      {"probe_rays", f.probe_rays},
                      {"full_rays", f.full_rays},
                      {"hemisphere_rays", f.hemisphere_rays},
                      {"link_epsilon", f.link_epsilon},
                      {"store_links", settings.store_links},
                      {"kernel_tolerance", f.kernel_tolerance},
                      {"probe_grid", settings.probes.grid},
                      {"probe_spacing", settings.probes.spacing},
                      {"probe_rays_each", settings.probes.ray_count},
                      {"surface_harmonic_rays", settings.surface_harmonics.ray_count},
                      {"receiver_rows_at_vertices", settings.receiver_rows.at_vertices},
                      {"receiver_rows_at_texels", settings.receiver_rows.at_texels},
                      {"receiver_row_least_error", settings.receiver_rows.least_error},
                      {"receiver_row_rays", settings.receiver_rows.ray_count},
                      {"receiver_row_tolerance", settings.receiver_rows.tolerance},
                      {"receiver_row_sets", settings.receiver_rows.most_sets},
                      {"lightmap_size", settings.lightmap.size},
                      {"lightmap_padding", settings.lightmap.padding}};
  if (is_hierarchical(settings)) json["tolerance"] = settings.tolerance;
  if (settings.operator_kind == OperatorKind::kLowRank) json["rank"] = settings.rank;
  return json_text(json);
}

nlohmann::json json_of(const SampledError& error) {
  return {{"mean", error.mean},
          {"mean_confidence", error.mean_confidence},
          {"max", error.max},
          {"max_confidence", error.max_confidence}};
}

/// Times differ from run to run, so they are not in the file.
std::string report_json(const BuildReport& report, const std::vector<KindError>& errors) {
  nlohmann::json by_kind = nlohmann::json::object();
  for (const KindError& e : errors) {
    by_kind[std::string(name(e.kind))] = {{"lights", e.light_count},
                                          {"dark_lights", e.dark_count},
                                          {"mean", e.mean},
                                          {"max", e.max},
                                          {"bound", e.bound}};
  }
  nlohmann::json json{{"triangles", report.triangle_count},
                      {"degenerate_triangles", report.degenerate_triangle_count},
                      {"display_triangles", report.display_triangle_count},
                      {"slivers", report.sliver_count},
                      {"unlit_sides", report.unlit_side_count},
                      {"covered_sides", report.covered_side_count},
                      {"opening_sides", report.opening_side_count},
                      {"buried_sides", report.buried_side_count},
                      {"patch_size_min", report.patch_size_min},
                      {"patch_size_median", report.patch_size_median},
                      {"patch_size_max", report.patch_size_max},
                      {"rays", report.ray_count},
                      {"pairs", report.pair_count},
                      {"form_factors", report.form_factor_count},
                      {"links", report.link_count},
                      {"solves", report.solve_count},
                      {"row_sum_error_before", report.closure.row_sum_error_before},
                      {"row_sum_error_after", report.closure.row_sum_error_after},
                      {"closure_change", report.closure.relative_change},
                      {"errors", by_kind},
                      {"meshes", report.mesh_names},
                      {"warnings", report.warnings}};
  if (report.form_factor_error) {
    json["form_factor_error_mean"] = report.form_factor_error->mean;
    json["form_factor_error_max"] = report.form_factor_error->max;
    json["form_factor_error_lights"] = report.form_factor_error->light_count;
    json["form_factor_error_dark_lights"] = report.form_factor_error->dark_count;
  }
  if (report.whole_error) {
    json["whole_error"] = {{"links", json_of(report.whole_error->links)},
                           {"whole", json_of(report.whole_error->whole)},
                           {"lights", report.whole_error->light_count}};
  }
  return json_text(json);
}

}  // namespace

void record_errors(const BuildSettings& decided, const std::vector<KindError>& errors,
                   BuildRecord& record) {
  record.error_bound = 0;
  for (const KindError& e : errors) {
    record.error_bound = std::max(record.error_bound, e.bound);
    if (e.kind != LightKind::kPoint) continue;
    record.error_mean = e.mean;
    record.error_max = e.max;
  }
  record.tolerance = is_hierarchical(decided) ? decided.tolerance : 0;
}

void record_build(const BuildSettings& decided, const BuildReport& report,
                  const std::vector<KindError>& errors, TransferData& data) {
  data.settings_json = settings_json(decided, report.form_factor_tolerance);
  data.report_json = report_json(report, errors);
}

}  // namespace rebounce

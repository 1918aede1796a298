#include "bench/report/report.h"

#include <omp.h>

#include <algorithm>
#include <cmath>

#include "bench/report/accuracy.h"
#include "bench/report/frames.h"
#include "bench/report/method.h"
#include "bench/report/physical_errors.h"
#include "bench/report/pictures.h"
#include "bench/report/rest_of_frame.h"
#include "bench/support/read_buffer.h"

namespace rebounce::bench {
namespace {

using nlohmann::ordered_json;

constexpr double kMicro = 1e6;

/// Three digits are enough for a plot.
double rounded(float value) {
  if (value == 0) return 0;
  const double scale = std::pow(10.0, 2 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

ordered_json names_of(const Contestant& contestant) {
  return {{"method", contestant.name},
          {"transfer", contestant.transfer},
          {"form", contestant.form},
          {"bytes", contestant.bytes}};
}

/// By a product, or by a start and its sweeps.
double bytes_read(const AccuracyRow& row, const Contestant& contestant) {
  const double sweeps = static_cast<double>(contestant.bytes_read) * std::max(1, row.sweeps);
  return sweeps + static_cast<double>(row.cold ? contestant.bytes_of_cold_start
                                               : contestant.bytes_of_warm_start);
}

ordered_json json_of(const AccuracyRow& row, const Contestant& contestant) {
  ordered_json json = names_of(contestant);
  json.update({{"change", row.change},
               {"sweeps", row.sweeps},
               {"cold", row.cold},
               {"error", row.error},
               {"error_max", row.error_max},
               {"iteration_error", row.iteration_error},
               {"bytes_read", bytes_read(row, contestant)},
               {"microseconds", row.time.median * kMicro},
               {"spread", row.time.spread},
               {"microseconds_cold_cache", row.cold_time.median * kMicro},
               {"spread_cold_cache", row.cold_time.spread}});
  return json;
}

ordered_json json_of(const Lag& lag) {
  return {{"mean", lag.mean}, {"worst", lag.worst}, {"never", lag.never}};
}

ordered_json json_of(const FrameRow& row, const Contestant& contestant) {
  ordered_json json = names_of(contestant);
  json.update({{"path", row.path}, {"budget_microseconds", row.budget}, {"sweeps", row.sweeps}});
  if (row.sweeps == 0) return json;
  json.update({{"error_mean", row.error_mean},
               {"error_p95", row.error_p95},
               {"error_worst", row.error_worst}});
  if (row.lag_percent) json["lag_1_percent"] = json_of(*row.lag_percent);
  if (row.lag_permille) json["lag_0.1_percent"] = json_of(*row.lag_permille);
  ordered_json& errors = json["errors"] = ordered_json::array();
  for (const float e : row.errors) errors.push_back(rounded(e));
  return json;
}

ordered_json json_of(const reference::RelativeError& error) {
  return {{"error", error.error},
          {"noise", error.noise},
          {"count", error.count},
          {"left_out", error.left_out_count}};
}

ordered_json json_of(const TruthResult& truth) {
  return {{"patch_means", json_of(truth.patch_means)},
          {"discretisation", json_of(truth.discretisation)},
          {"reconstruction", json_of(truth.reconstruction)},
          {"form_factors", truth.form_factors},
          {"compression", truth.compression}};
}

ordered_json json_of(const Pictures& pictures) {
  ordered_json json = {{"reference", pictures.reference},
                       {"microseconds", pictures.time},
                       {"difference_gain", kDifferenceGain}};
  for (const DrawnMethod& method : pictures.methods) {
    json["methods"].push_back({{"name", method.name},
                               {"sweeps", method.sweeps},
                               {"error", method.error},
                               {"picture", method.picture},
                               {"difference", method.difference}});
  }
  return json;
}

ordered_json json_of(const std::vector<Cost>& costs) {
  ordered_json json = ordered_json::array();
  for (const Cost& cost : costs) {
    json.push_back({{"phase", cost.phase}, {"seconds", cost.seconds}});
    if (cost.bytes > 0) json.back()["bytes"] = cost.bytes;
  }
  return json;
}

double mean_reflectance(const PatchTable& patches) {
  double sum = 0, area = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const Float3& r = patches.reflectance[i];
    sum += static_cast<double>(patches.area[i]) * (r[0] + r[1] + r[2]) / kChannelCount;
    area += patches.area[i];
  }
  return sum / area;
}

/// What the truth of the light paths, the dense operator, is off by under the light of a lamp.
double dense_error(const std::vector<AccuracyRow>& rows,
                   const std::vector<Contestant>& contestants) {
  double worst = 0;
  for (const AccuracyRow& row : rows) {
    if (contestants[row.contestant].name != kDenseInverse || row.change == kRepainted) continue;
    worst = std::max(worst, row.error_max);
  }
  return worst;
}

/// Of as many threads as relighting has.
double memory_bandwidth(const ReportSettings& settings) {
  const int threads = omp_get_max_threads();
  omp_set_num_threads(settings.solve_threads);
  const double bandwidth = measure_memory_bandwidth();
  omp_set_num_threads(threads);
  return bandwidth;
}

ordered_json describe(const Contenders& contenders, const ReportSettings& settings) {
  const TransferData& data = *contenders.data;
  return {{"patches", data.patches.size()},
          {"triangles", contenders.report.triangle_count},
          {"mean_reflectance", mean_reflectance(data.patches)},
          {"form_factors", 2 * data.exchange.column.size()},
          {"links", contenders.report.link_count},
          {"rays", contenders.report.ray_count},
          {"file_bytes", contenders.file_bytes},
          {"memory_bandwidth", memory_bandwidth(settings)},
          {"exchange_bytes", 8 * data.exchange.column.size()},
          {"peak_memory_bytes", contenders.peak_memory_bytes},
          {"costs", json_of(contenders.costs)}};
}

}  // namespace

ordered_json measure_scene(const std::string& scene, const ReportSettings& settings,
                           const std::filesystem::path& folder, const std::string& name,
                           const ReportProgress& progress) {
  const Contenders contenders = build_contenders(scene, settings, progress);
  const std::vector<Contestant> contestants = list_contestants(contenders, settings);
  ordered_json json = describe(contenders, settings);

  const auto accuracy = measure_accuracy(contenders, contestants, settings, progress);
  for (const AccuracyRow& row : accuracy) {
    json["accuracy"].push_back(json_of(row, contestants[row.contestant]));
  }
  const double truth_error = dense_error(accuracy, contestants);
  json["dense_error"] = truth_error;

  const std::vector<RunTime> times = run_times(accuracy, contestants.size());
  for (const FrameRow& row :
       measure_frames(contenders, contestants, times, truth_error, settings, progress)) {
    json["frames"].push_back(json_of(row, contestants[row.contestant]));
  }
  const RestOfFrame rest = measure_rest_of_frame(contenders, settings, progress);
  json["rest_of_frame"] = {{"direct_microseconds", rest.direct.median * kMicro},
                           {"direct_spread", rest.direct.spread},
                           {"outputs_microseconds", rest.outputs.median * kMicro},
                           {"outputs_spread", rest.outputs.spread}};
  const FurnaceResult furnace = measure_furnace(*contenders.data);
  json["furnace"] = {{"error_mean", furnace.error_mean}, {"error_max", furnace.error_max}};
  if (settings.truth) json["truth"] = json_of(measure_truth(scene, contenders, settings, progress));
  if (settings.picture_width > 0) {
    json["pictures"] =
        json_of(draw_pictures(contenders, contestants, times, settings, folder, name, progress));
  }
  return json;
}

}  // namespace rebounce::bench

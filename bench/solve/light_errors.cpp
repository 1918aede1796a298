#include "bench/solve/light_errors.h"

#include <algorithm>
#include <functional>
#include <optional>

#include "bench/support/input.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/inverse/solved_transfer.h"
#include "precompute/lights/measured_error.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_lighting.h"
#include "precompute/lights/reference_solution.h"
#include "precompute/lights/validation_error.h"
#include "rebounce/error.h"
#include "transfer/base/area_norm.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::bench {
namespace {

// The promise is about groups of so many lights.
constexpr std::size_t kGateLights = 64;

// Residual of conjugate gradients, of what a light gives off: of that, hardly less than a millionth
// arrives.
constexpr double kResidual = 1e-9;

// Residual of many solves side by side, of what a light reflects: a thirtieth of usual errors.
constexpr double kSolvedResidual = 1e-4;

// Lights that are held in memory.
constexpr int kLightsAtOnce = 1024;

/// What arrives of lights, as the form factors of a file say.
class Truth {
 public:
  /// `data` must outlive the object.
  Truth(const TransferData& data, bool iterate) : data_(data), plain_(data) {
    if (iterate) return;
    if (!data.exchange.empty()) {
      dense_ = build_dense_transfer(data.exchange, data.patches, Precision::kF32);
    } else if (data.links.empty()) {
      solved_.emplace(*data.compressed_form_factors, data.patches, kSolvedResidual);
    }
  }

  std::vector<std::vector<Float3>> operator()(std::span<const std::vector<Float3>> lights) const {
    if (dense_) return products(DenseMatrix(*dense_), lights);
    return solved_ ? solved_->indirect_irradiances(lights) : by_iteration(lights);
  }

  /// The largest relative difference from plain conjugate gradients over the first lights.
  double error(std::span<const std::vector<Float3>> lights) const {
    const auto some =
        lights.first(std::min<std::size_t>(lights.size(), ReferenceSolver::kBatchLights));
    const auto truths = (*this)(some), others = by_iteration(some);
    double largest = 0;
    for (std::size_t k = 0; k < some.size(); ++k) {
      if (arrives_nowhere(others[k], some[k], data_.patches.area)) continue;
      largest = std::max(largest, relative_difference(truths[k], others[k], data_.patches.area));
    }
    return largest;
  }

 private:
  std::vector<std::vector<Float3>> by_iteration(std::span<const std::vector<Float3>> lights) const {
    return plain_.indirect_irradiances(lights, kResidual);
  }

  const TransferData& data_;
  ReferenceSolver plain_;
  std::shared_ptr<const DenseOperator> dense_;  ///< of pairs
  std::optional<SolvedTransfer> solved_;        ///< of compressed form factors
};

/// A number of the report of a file; empty where it has none.
Table::Cell recorded(const TransferData& data, const std::string& path) {
  const auto report = nlohmann::json::parse(data.report_json, nullptr, false);
  const nlohmann::json::json_pointer place(path);
  if (!report.contains(place) || !report.at(place).is_number()) return {};
  return report.at(place).get<double>();
}

/// The data that hold the truth: those of `path`, or `data` where that is empty.
std::shared_ptr<const TransferData> truth_of(const TransferData& data, const std::string& path) {
  if (path.empty()) return {std::shared_ptr<const TransferData>(), &data};
  auto other = std::make_shared<const TransferData>(load_transfer_file(path));
  if (other->patches.area != data.patches.area ||
      other->patches.reflectance != data.patches.reflectance) {
    throw Error(path + " has other patches or materials");
  }
  return other;
}

/// The number of patches that a light is on: the squared sum of their flux over the sum of squares.
double lit_patches(std::span<const Float3> exitance, std::span<const float> area) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const double flux = area[i] * (exitance[i][0] + exitance[i][1] + exitance[i][2]);
    sum += flux;
    squares += flux * flux;
  }
  return squares > 0 ? sum * sum / squares : 0;
}

std::size_t count_above(std::span<const LightError> errors, double limit) {
  return static_cast<std::size_t>(
      std::ranges::count_if(errors, [=](const LightError& e) { return e.error > limit; }));
}

/// The part of whole groups of kGateLights, in the order in which they were drawn, of which one is
/// above the limit.
Table::Cell groups_above(std::span<const LightError> errors, double limit) {
  const std::size_t groups = errors.size() / kGateLights;
  if (groups == 0) return {};
  std::size_t above = 0;
  for (std::size_t k = 0; k < groups; ++k) {
    above += count_above(errors.subspan(k * kGateLights, kGateLights), limit) > 0 ? 1 : 0;
  }
  return static_cast<double>(above) / static_cast<double>(groups);
}

}  // namespace

Table make_light_error_table() {
  return Table({"scene",
                "patches",
                "tolerance",
                "bytes_per_patch",
                "kind",
                "lights",
                "error_mean",
                "error_max",
                "arriving_of_max",
                "over_3_tolerances",
                "groups_of_64_over",
                "bound_of_kind",
                "over_bound_of_kind",
                "bound",
                "over_bound",
                "truth_error",
                "stated_mean",
                "stated_mean_confidence",
                "stated_max",
                "stated_max_confidence"});
}

Table make_single_light_table() {
  return Table({"scene", "patches", "kind", "error", "arriving", "lit_patches"});
}

void measure_light_errors(const TransferData& data, const LightErrorSettings& settings,
                          Table& table, Table& single) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const auto with_truth = truth_of(data, settings.truth);
  const Truth truth(*with_truth, settings.iterate);
  const BuildRecord& record = data.record;
  const double limit = kLargestOverMean * record.tolerance;
  for (const LightKind kind : kLightKinds) {
    std::vector<LightError> errors;
    double truth_error = 0;
    for (int done = 0; done < settings.light_count; done += kLightsAtOnce) {
      const int count = std::min(kLightsAtOnce, settings.light_count - done);
      const auto lights = random_initial_exitances(data, tracer, kind, count, settings.seed + done,
                                                   data.transfer->roles());
      if (done == 0) truth_error = truth.error(lights);
      for (const LightError& e : light_errors(data, lights, std::cref(truth))) {
        errors.push_back(e);
        if (settings.each.empty()) continue;
        single.add({scene_name(data), data.patches.size(), name(kind), e.error, e.arriving,
                    lit_patches(lights[e.light], data.patches.area)});
      }
    }
    if (errors.empty()) continue;
    const auto worst = std::ranges::max_element(errors, {}, &LightError::error);
    double sum = 0;
    for (const LightError& light : errors) sum += light.error;
    const Table::Cell bound = recorded(data, "/errors/" + std::string(name(kind)) + "/bound");
    const auto stated = [&](const std::string& what) {
      return kind == LightKind::kPoint ? recorded(data, "/whole_error/whole/" + what)
                                       : Table::Cell();
    };
    table.add(
        {scene_name(data),
         data.patches.size(),
         record.tolerance,
         static_cast<double>(data.transfer->bytes()) / static_cast<double>(data.patches.size()),
         name(kind),
         errors.size(),
         sum / static_cast<double>(errors.size()),
         worst->error,
         worst->arriving,
         count_above(errors, limit),
         groups_above(errors, limit),
         bound,
         bound.is_null() ? Table::Cell() : Table::Cell(count_above(errors, bound.get<double>())),
         record.error_bound,
         count_above(errors, record.error_bound),
         truth_error,
         stated("mean"),
         stated("mean_confidence"),
         stated("max"),
         stated("max_confidence")});
  }
}

}  // namespace rebounce::bench

// What a file promises, tried: an operator under many fresh lights of every kind. The truth comes
// from the form factors that it was made from: conjugate gradients or, of pairs, a dense inverse of
// their own, which is many times faster and is itself held against conjugate gradients.

#include <algorithm>
#include <functional>
#include <optional>

#include "bench/input.h"
#include "bench/program.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/measured_error.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_lighting.h"
#include "precompute/lights/reference_solution.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/error.h"

namespace rebounce::bench {
namespace {

// The gates are over so many lights, and their largest error may be so many times the tolerance.
constexpr std::size_t kGateLights = 64;
constexpr double kLargestOverMean = 3;

struct LightErrorOptions {
  std::vector<std::string> inputs;
  std::vector<std::size_t> patch_counts = {1000};
  int light_count = 1000;     ///< of each kind
  std::uint64_t seed = 4711;  ///< none that operators are built or checked with
  bool iterate = false;
  BuildSettings settings;
  CommonOptions common{.repeats = 1};
};

// Residual of conjugate gradients, of what a light gives off: of that, hardly less than a millionth
// arrives.
constexpr double kResidual = 1e-9;

/// What arrives of lights, as the form factors of a file say.
class Truth {
 public:
  Truth(const TransferData& data, bool iterate)
      : data_(data),
        plain_(data),
        solver_(iterate ? plain_ : plain_.preconditioned(data.transfer)) {
    if (!iterate && !data.exchange.empty()) {
      dense_ = build_dense_transfer(data.exchange, data.patches, Precision::kF32);
    }
  }

  std::vector<std::vector<Float3>> operator()(std::span<const std::vector<Float3>> lights) const {
    return dense_ ? products(DenseMatrix(*dense_), lights)
                  : solver_.indirect_irradiances(lights, kResidual);
  }

  /// The largest relative difference from plain conjugate gradients over the first lights.
  double error(std::span<const std::vector<Float3>> lights) const {
    const auto some =
        lights.first(std::min<std::size_t>(lights.size(), ReferenceSolver::kBatchLights));
    const auto truths = (*this)(some);
    const auto others = plain_.indirect_irradiances(some, kResidual);
    double largest = 0;
    for (std::size_t k = 0; k < some.size(); ++k) {
      if (arrives_nowhere(others[k], some[k], data_.patches.area)) continue;
      largest = std::max(largest, relative_difference(truths[k], others[k], data_.patches.area));
    }
    return largest;
  }

 private:
  const TransferData& data_;
  ReferenceSolver plain_, solver_;
  std::shared_ptr<const DenseOperator> dense_;  ///< null: solver_ iterates
};

/// With the form factors that the operator was made from: of a scene from links they are found once
/// more. Throws Error if a file does not hold them.
TransferData load_or_build_with_truth(const std::string& input, BuildSettings settings) {
  settings.store_form_factors = settings.exchange_source != ExchangeSource::kLinks;
  TransferData data = load_or_build(input, settings);
  if (!data.exchange.empty()) return data;
  if (std::filesystem::path(input).extension() == ".safetensors") {
    throw Error(data.record.scene_name +
                ": the file does not hold the pairs that its operator was made from, which the "
                "truth is found with; give the scene, with --form-factors links");
  }
  settings.operator_kind = OperatorKind::kNoOperator;
  data.links = load_or_build(input, settings).links;
  return data;
}

/// What the file says of lights of one kind; nothing where it was not measured.
std::optional<double> recorded_bound(const BuildRecord& record, LightKind kind) {
  const auto report = nlohmann::json::parse(record.report_json, nullptr, false);
  const nlohmann::json::json_pointer place("/errors/" + std::string(name(kind)) + "/bound");
  if (!report.contains(place) || !report.at(place).is_number()) return std::nullopt;
  return report.at(place).get<double>();
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

void measure(const TransferData& data, const LightErrorOptions& options, Table& table) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const Truth truth(data, options.iterate);
  const BuildRecord& record = data.record;
  const double limit = kLargestOverMean * record.tolerance;
  for (const LightKind kind : kLightKinds) {
    const auto lights = random_initial_exitances(data, tracer, kind, options.light_count,
                                                 options.seed, data.transfer->roles());
    const std::vector<LightError> errors = light_errors(data, lights, std::cref(truth));
    if (errors.empty()) continue;
    const auto worst = std::ranges::max_element(errors, {}, &LightError::error);
    double sum = 0;
    for (const LightError& light : errors) sum += light.error;
    const auto bound = recorded_bound(record, kind);
    table.add(
        {scene_name(data), data.patches.size(), record.tolerance,
         static_cast<double>(data.transfer->bytes()) / static_cast<double>(data.patches.size()),
         name(kind), errors.size(), sum / static_cast<double>(errors.size()), worst->error,
         worst->arriving, count_above(errors, limit), groups_above(errors, limit),
         bound ? Table::Cell(*bound) : Table::Cell(),
         bound ? Table::Cell(count_above(errors, *bound)) : Table::Cell(), record.error_bound,
         count_above(errors, record.error_bound), truth.error(lights)});
  }
}

void run(const LightErrorOptions& options) {
  Table table({"scene", "patches", "tolerance", "bytes_per_patch", "kind", "lights", "error_mean",
               "error_max", "arriving_of_max", "over_3_tolerances", "groups_of_64_over",
               "bound_of_kind", "over_bound_of_kind", "bound", "over_bound", "truth_error"});
  for (const std::string& input : options.inputs) {
    const bool file = std::filesystem::path(input).extension() == ".safetensors";
    for (const std::size_t patch_count : options.patch_counts) {
      BuildSettings settings = options.settings;
      settings.subdivision.patch_count = patch_count;
      measure(load_or_build_with_truth(input, settings), options, table);
      if (file) break;
    }
  }
  publish("light_errors", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  using namespace rebounce::bench;
  LightErrorOptions options;
  CLI::App app("Tries operators under fresh lights of every kind, against the bound in their files",
               "bench_light_errors");
  add_input_option(app, options.inputs);
  add_patches_option(app, options.patch_counts);
  app.add_option_function<std::string>(
         "--form-factors",
         [&](const std::string& kind) {
           options.settings.exchange_source = kind == "links" ? rebounce::ExchangeSource::kLinks
                                                              : rebounce::ExchangeSource::kPairs;
         },
         "What operators are built from")
      ->check(CLI::IsMember({"pairs", "links"}));
  app.add_option("--tolerance", options.settings.tolerance, "Of operators that are built")
      ->check(CLI::Range(1e-5, 0.5))
      ->capture_default_str();
  app.add_option("--lights", options.light_count, "Lights of each kind")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Seed of the lights, other than that of the build")
      ->capture_default_str();
  app.add_flag("--iterate", options.iterate,
               "Find the truth by conjugate gradients alone, with neither a dense inverse nor the "
               "operator to begin with");
  add_common_options(app, options.common);
  return run_program(app, argc, argv, options.common, [&] { run(options); });
}

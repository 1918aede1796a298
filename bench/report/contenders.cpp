#include "bench/report/contenders.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "bench/support/timing.h"
#include "precompute/base/process_memory.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/compression/low_rank_transfer.h"
#include "precompute/compression/tolerance_search.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/fitting_lights.h"
#include "rebounce/error.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce::bench {
namespace {

// Of both sides. Sweeps are faster than with halves, and light is rounded by 3e-5 only.
constexpr Precision kPrecision = Precision::kQ8;

/// Builds one thing after the other and notes what each costs.
class ContenderBuilder {
 public:
  ContenderBuilder(const ReportSettings& settings, const ReportProgress& progress)
      : settings_(settings), progress_(progress) {}

  Contenders build(const std::string& scene) {
    build_data(scene);
    lights_ = draw_fitting_lights(*result_.data, *result_.tracer, settings_.seed);
    for (const double tolerance : settings_.tolerances) add_hierarchical(tolerance);
    add_dense();
    result_.forms = exact_forms(*result_.data);
    const FittingLights radiosities = radiosities_of(lights_, *result_.data);
    const FormFactorMatrix matrix(result_.data->exchange, result_.data->patches.area);
    for (const double tolerance : settings_.tolerances) {
      add_compressed(tolerance, radiosities);
      add_shared(matrix, tolerance, radiosities);
    }
    for (const std::size_t rank : settings_.ranks) add_low_rank(rank);
    if (settings_.links) result_.forms.push_back(links_form(*result_.data));
    measure_file();
    return std::move(result_);
  }

 private:
  const DenseOperator& dense() const {
    return static_cast<const DenseOperator&>(*result_.data->transfer);
  }

  /// Runs `work`, which takes a Progress, and appends its cost; `bytes_of` what it made.
  template <typename Work, typename BytesOf>
  auto timed(const std::string& phase, const Work& work, const BytesOf& bytes_of) {
    const Progress progress = [this, &phase](double part) { return progress_(phase, part); };
    if (!progress(0)) throw Cancelled();
    decltype(work(progress)) made;
    const double seconds = seconds_of([&] { made = work(progress); });
    result_.costs.push_back({phase, seconds, bytes_of(*made)});
    return made;
  }

  /// The dense operator by itself: it is exact, and its error need not be measured.
  void build_data(const std::string& scene) {
    BuildSettings build;
    build.subdivision.patch_count = settings_.patch_count;
    build.form_factors.seed = settings_.seed;
    build.operator_kind = OperatorKind::kNoOperator;
    build.store_form_factors = true;
    build.store_links = settings_.links;
    TransferData data = build_transfer_data(scene, build, result_.report, progress_);
    for (const auto& [phase, seconds] : result_.report.seconds) {
      result_.costs.push_back({phase, seconds});
    }
    const auto work = [&](const Progress& progress) {
      return build_dense_transfer(data.exchange, data.patches, Precision::kF32, progress);
    };
    data.transfer = timed("operator", work, bytes_of_operator);
    result_.peak_memory_bytes = peak_memory_bytes();
    result_.tracer = std::make_unique<const RayTracer>(make_surface_tracer(data.mesh));
    result_.data = std::make_shared<const TransferData>(std::move(data));
  }

  void add_dense() { result_.operators.push_back({"dense f32", result_.data->transfer}); }

  void add_hierarchical(double tolerance) {
    const std::string name = hierarchical_name(tolerance);
    const auto work = [&](const Progress& progress) {
      return build_hierarchical_transfer(dense(), result_.data->patches, lights_,
                                         {tolerance, kPrecision}, progress);
    };
    result_.operators.push_back({name, timed(name, work, bytes_of_operator)});
  }

  void add_low_rank(std::size_t rank) {
    const std::string name = fmt::format("low rank {}", rank);
    const auto work = [&](const Progress& progress) {
      return build_low_rank_transfer(dense(), {rank, Precision::kF16}, progress);
    };
    result_.operators.push_back({name, timed(name, work, bytes_of_operator)});
  }

  void add_compressed(double tolerance, const FittingLights& radiosities) {
    const std::string name = compressed_name(tolerance);
    const auto work = [&](const Progress& progress) {
      return compress_form_factors(result_.data->exchange, result_.data->patches, radiosities,
                                   {tolerance, kPrecision}, progress);
    };
    const auto compressed = timed("form factors " + name, work, bytes_of_operator);
    if (tolerance == kDefaultTolerance) compressed_ = compressed;
    result_.forms.push_back(compressed_form(name, compressed));
  }

  void add_shared(const FormFactorMatrix& matrix, double tolerance,
                  const FittingLights& radiosities) {
    const std::string name = shared_name(tolerance);
    const auto work = [&](const Progress& progress) {
      return compress_to_tolerance(matrix, result_.data->patches, radiosities,
                                   {tolerance, kPrecision}, progress);
    };
    result_.forms.push_back(
        shared_form(name, timed("form factors " + name, work, bytes_of_operator)));
  }

  void measure_file() {
    TransferData stored = *result_.data;
    stored.transfer = result_.transfer(hierarchical_name(kDefaultTolerance));
    stored.compressed_form_factors = compressed_;
    stored.links = {};
    const auto path = std::filesystem::temp_directory_path() /
                      fmt::format("rebounce_report_{}.safetensors", getpid());
    save_transfer_file(path, stored);
    result_.file_bytes = std::filesystem::file_size(path);
    std::filesystem::remove(path);
  }

  static std::size_t bytes_of_operator(const TransferOperator& transfer) {
    return transfer.bytes();
  }

  const ReportSettings& settings_;
  const ReportProgress& progress_;
  Contenders result_;
  FittingLights lights_;
  std::shared_ptr<const HierarchicalOperator> compressed_;  ///< at the default tolerance
};

}  // namespace

const std::shared_ptr<const FormFactorOperator>& Contenders::form(std::string_view name) const {
  const auto found = std::ranges::find(forms, name, &Form::name);
  if (found == forms.end())
    throw Error("the report has no form factors named " + std::string(name));
  return found->form_factors;
}

const std::shared_ptr<const TransferOperator>& Contenders::transfer(std::string_view name) const {
  const auto found = std::ranges::find(operators, name, &StoredOperator::name);
  if (found == operators.end())
    throw Error("the report has no operator named " + std::string(name));
  return found->transfer;
}

std::string hierarchical_name(double tolerance) {
  return "hierarchical " + percent(tolerance);
}

Contenders build_contenders(const std::string& scene, const ReportSettings& settings,
                            const ReportProgress& progress) {
  return ContenderBuilder(settings, progress).build(scene);
}

}  // namespace rebounce::bench

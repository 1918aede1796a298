// Every way to keep the inverse, and iteration on compressed form factors beside them: bytes, error
// over many lights, seconds to build, microseconds to apply and how far that is from merely reading
// as many bytes. The curves of notes/operator.md are drawn from its CSV by transfer_curves.py.

#include <omp.h>

#include <algorithm>
#include <numeric>
#include <optional>

#include "bench/program.h"
#include "bench/read_buffer.h"
#include "bench/report/contenders.h"
#include "bench/report/method.h"
#include "bench/timing.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_solution.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/error.h"

namespace rebounce::bench {
namespace {

constexpr int kLightCount = 64;  // of each kind that errors are taken over
constexpr int kMostSweeps = 9;
constexpr std::uint64_t kLightSeed = 77;  // no lights that an operator was fitted to

struct TransferOptions {
  std::vector<std::string> scenes;
  std::vector<std::size_t> patch_counts = {1000, 4000};
  bool untimed = false;
  CommonOptions common{.repeats = 21};
};

/// From so many patches on there are fewer kinds: each takes minutes.
constexpr std::size_t kHuge = ReportSettings::kHuge;

ReportSettings settings_for(std::size_t patch_count) {
  ReportSettings settings;
  settings.patch_count = patch_count;
  settings.form_factor_tolerances = {0.001, 0.003};
  settings.links = false;
  if (patch_count >= kHuge) {
    settings.operators = {
        {0.005, Precision::kQ8}, {0.02, Precision::kQ8}, {0.005, Precision::kQ16}};
    settings.ranks = {256};
    return settings;
  }
  settings.operators.clear();
  for (const double tolerance : {0.005, 0.02, 0.01, 0.002, 0.001}) {
    settings.operators.push_back({tolerance, Precision::kQ8});
  }
  for (const double tolerance : {0.02, 0.005, 0.001}) {
    settings.operators.push_back({tolerance, Precision::kF16});
    settings.operators.push_back({tolerance, Precision::kF32});
  }
  for (const double tolerance : {0.02, 0.005}) {
    settings.operators.push_back({tolerance, Precision::kQ16});
  }
  return settings;
}

/// Lights of one kind, and the light in the patches that they lead to.
struct Lights {
  std::vector<std::vector<Float3>> initial_exitance, truth;  ///< [lights][n] in lx
};

struct Errors {
  double mean = 0, max = 0;
};

/// One row: a product, or some sweeps of Gauss-Seidel, forward or symmetric.
struct Entry {
  std::string name, form{};
  std::size_t bytes = 0;       ///< stored
  std::size_t bytes_read = 0;  ///< by a product or a sweep, what it reads twice counted twice
  std::optional<double> build_seconds{};
  const TransferOperator* transfer = nullptr;  ///< null: it iterates
  const FormFactorOperator* form_factors = nullptr;
  int sweeps = 0;
  std::unique_ptr<Method> method{};
  std::unique_ptr<ReadBuffer> read{};
};

class TransferBenchmark {
 public:
  TransferBenchmark(const Contenders& contenders, const ReportSettings& settings)
      : contenders_(contenders), patches_(contenders.data->patches) {
    const ReferenceSolver reference(contenders.data->exchange, patches_);
    for (const LightKind kind : {LightKind::kPoint, LightKind::kPatch}) {
      lights_.push_back(draw(kind, reference));
    }
    for (const Contestant& contestant : list_contestants(contenders, settings)) add(contestant);
  }

  void run(const TransferOptions& options, Table& table) const {
    const int threads = omp_get_max_threads();
    std::vector<std::vector<Errors>> errors;
    for (const Entry& entry : entries_) {
      errors.emplace_back();
      for (const Lights& lights : lights_) errors.back().push_back(errors_of(entry, lights));
    }
    std::vector<Timing> times;
    if (!options.untimed) {
      omp_set_num_threads(1);
      times = time(options.common.repeats);
      omp_set_num_threads(threads);
    }
    for (std::size_t k = 0; k < entries_.size(); ++k) report(k, errors[k], times, table);
  }

 private:
  Lights draw(LightKind kind, const ReferenceSolver& reference) const {
    Lights lights;
    const auto drawn = random_initial_exitances(*contenders_.data, *contenders_.tracer, kind,
                                                kLightCount, kLightSeed);
    const auto truths = reference.indirect_irradiances(drawn);
    for (std::size_t k = 0; k < drawn.size(); ++k) {
      if (arrives_nowhere(truths[k], drawn[k], patches_.area)) continue;
      lights.initial_exitance.push_back(drawn[k]);
      lights.truth.push_back(truths[k]);
    }
    if (lights.truth.empty()) throw Error("no light arrives anywhere in this scene");
    return lights;
  }

  void add(const Contestant& contestant) {
    const bool compressed = contestant.form.starts_with("compressed");
    const bool relaxes = contestant.method == SolveMethod::kGaussSeidel ||
                         contestant.method == SolveMethod::kSymmetricGaussSeidel;
    if (contestant.product) {
      const auto stored =
          std::ranges::find(contenders_.operators, contestant.transfer, &StoredOperator::name);
      Entry& entry = add(contestant, 0);
      entry.transfer = stored->transfer.get();
      entry.bytes_read = entry.transfer->bytes_per_apply();
    } else if (relaxes && compressed) {
      const int reads = contestant.method == SolveMethod::kGaussSeidel ? 2 : 1;
      for (int sweeps = 1; sweeps <= kMostSweeps; ++sweeps) {
        Entry& entry = add(contestant, sweeps);
        entry.form_factors = contenders_.form(contestant.form).get();
        entry.bytes_read = reads * entry.bytes;
      }
    }
  }

  Entry& add(const Contestant& contestant, int sweeps) {
    Entry& entry = entries_.emplace_back(Entry{.name = contestant.name,
                                               .form = contestant.transfer + contestant.form,
                                               .bytes = contestant.bytes,
                                               .sweeps = sweeps,
                                               .method = contestant.make(contenders_)});
    entry.read = std::make_unique<ReadBuffer>(entry.bytes);
    for (const Cost& cost : contenders_.costs) {
      if (cost.phase == entry.form || cost.phase == "form factors " + entry.form) {
        entry.build_seconds = cost.seconds;
      }
    }
    return entry;
  }

  /// H [n] in lx as this entry has it.
  std::vector<Float3> indirect_irradiance(const Entry& entry,
                                          const std::vector<Float3>& light) const {
    if (entry.transfer) return product(*entry.transfer, light);
    entry.method->reset();
    entry.method->run(light, entry.sweeps);
    return gather(*entry.form_factors, entry.method->radiosity());
  }

  Errors errors_of(const Entry& entry, const Lights& lights) const {
    Errors errors;
    for (std::size_t k = 0; k < lights.truth.size(); ++k) {
      const double error = relative_difference(
          indirect_irradiance(entry, lights.initial_exitance[k]), lights.truth[k], patches_.area);
      errors.mean += error / static_cast<double>(lights.truth.size());
      errors.max = std::max(errors.max, error);
    }
    return errors;
  }

  /// Two for each entry: reading its bytes, and its work.
  std::vector<Timing> time(int repeats) const {
    const std::vector<Float3>& light = lights_.front().initial_exitance.front();
    std::vector<TimedCase> cases;
    for (const Entry& entry : entries_) {
      cases.push_back({.work = [&entry] { entry.read->read(); }});
      cases.push_back({.work = [&entry, &light] { entry.method->run(light, entry.sweeps); },
                       .prepare = [&entry] { entry.method->reset(); },
                       .repeat_prepared = true});
    }
    return time_interleaved(cases, {.rounds = repeats});
  }

  /// `times` as time() has them, or none.
  void report(std::size_t k, const std::vector<Errors>& errors, std::span<const Timing> times,
              Table& table) const {
    const Entry& entry = entries_[k];
    const auto n = static_cast<double>(patches_.size());
    std::vector<Table::Cell> row = {contenders_.data->record.scene_name,
                                    patches_.size(),
                                    entry.name,
                                    entry.form,
                                    entry.sweeps > 0 ? Table::Cell(entry.sweeps) : Table::Cell(),
                                    static_cast<double>(entry.bytes) / n,
                                    errors[0].mean,
                                    errors[0].max,
                                    errors[1].mean,
                                    errors[1].max};
    row.resize(row.size() + 5);
    if (!times.empty()) {
      const Timing &read = times[2 * k], &work = times[2 * k + 1];
      const double read_seconds = read.median * std::max(entry.sweeps, 1);
      auto cell = row.end() - 5;
      if (entry.build_seconds) *cell = *entry.build_seconds;
      *++cell = work.median * 1e6;
      *++cell = work.spread;
      *++cell = read_seconds / work.median;
      *++cell = static_cast<double>(entry.bytes_read) / static_cast<double>(entry.bytes) *
                read_seconds / work.median;
    }
    table.add(std::move(row));
  }

  const Contenders& contenders_;
  const PatchTable& patches_;
  std::vector<Lights> lights_;  ///< points, patches
  std::vector<Entry> entries_;
};

void run(const TransferOptions& options) {
  Table table({"scene", "patches", "kind", "form", "sweeps", "bytes_per_patch", "error_mean",
               "error_max", "patch_light_error_mean", "patch_light_error_max", "build_seconds",
               "microseconds", "spread", "of_read", "bandwidth_of_read"});
  for (const std::string& scene : options.scenes) {
    for (const std::size_t patch_count : options.patch_counts) {
      const ReportSettings settings = settings_for(patch_count);
      const Contenders contenders =
          build_contenders(scene, settings, [](std::string_view, double) { return true; });
      TransferBenchmark(contenders, settings).run(options, table);
      // What is there stays if a later scene fails, or is not waited for.
      if (!options.common.csv.empty()) write_text(options.common.csv, table.csv());
    }
  }
  publish("transfer", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::TransferOptions options;
  CLI::App app("Compares all kinds of operators by bytes, error and time, on one thread.",
               "bench_transfer");
  rebounce::bench::add_scene_option(app, options.scenes);
  rebounce::bench::add_patches_option(app, options.patch_counts);
  app.add_flag("--untimed", options.untimed,
               "Bytes and errors alone, for a machine that has other things to do");
  rebounce::bench::add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}

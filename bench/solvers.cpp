// The iterative methods on every form of the form factors: what a sweep costs beside the bandwidth
// with which the same run merely reads as many bytes, and what a solve costs after the light
// changed.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "bench/input.h"
#include "bench/light_changes.h"
#include "bench/program.h"
#include "bench/read_buffer.h"
#include "bench/reflected_light.h"
#include "bench/timing.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/lights/fitting_lights.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce::bench {
namespace {

struct SolverOptions {
  std::vector<std::string> inputs;
  BuildSettings settings;
  std::string solve_csv;
  bool sweeps_only = false;
  CommonOptions common{.repeats = 7};
};

constexpr double kDefaultTolerance = 0.001;
constexpr std::array<double, 3> kErrors = {0.01, 0.001, 0.0001};
constexpr int kMostSweeps = 64;

/// One form of F.
struct Form {
  std::string name;
  std::unique_ptr<const FormFactorOperator> form_factors;

  /// Null if it only gathers.
  const SweepableFormFactors* sweepable() const {
    return dynamic_cast<const SweepableFormFactors*>(form_factors.get());
  }
};

std::shared_ptr<const HierarchicalOperator> compressed(const TransferData& data,
                                                       const BuildSettings& settings) {
  if (data.compressed_form_factors) return data.compressed_form_factors;
  const DrawnLights lights = draw_fitting_lights(data, make_surface_tracer(data.mesh), 1);
  const DrawnLights fitting = radiosities_of(lights, data);
  return compress_form_factors(
      data.exchange, data.patches, fitting.view(),
      {.tolerance = settings.form_factor_tolerance, .precision = Precision::kF16});
}

/// Those that the data hold or that can be made of all pairs, where the data hold these.
std::vector<Form> make_forms(const TransferData& data, const BuildSettings& settings) {
  std::vector<Form> forms;
  const std::vector<float>& area = data.patches.area;
  const bool pairs = data.exchange.patch_count() > 0;
  if (pairs) {
    forms.push_back({"rows", std::make_unique<FormFactorRows>(data.exchange, area)});
    forms.push_back({"blocks", std::make_unique<FormFactorBlocks>(data.exchange, area)});
    forms.push_back({"exchange", std::make_unique<ExchangeBlocks>(data.exchange, area)});
  }
  if (!data.links.empty()) {
    forms.push_back(
        {"links", std::make_unique<LinkedFormFactors>(data.links, area, data.patches.centroid)});
  }
  if (pairs || data.compressed_form_factors) {
    forms.push_back(
        {"compressed", std::make_unique<CompressedFormFactors>(compressed(data, settings))});
  }
  return forms;
}

bool sweeps_over_rows(SolveMethod method) {
  return method == SolveMethod::kGaussSeidel || method == SolveMethod::kSymmetricGaussSeidel;
}

class SolverBenchmark {
 public:
  SolverBenchmark(const TransferData& data, const SolverOptions& options)
      : data_(data),
        options_(options),
        forms_(make_forms(data, options.settings)),
        changes_(light_changes(data)) {}

  /// A row for each form and kind of sweep, beside what memory gives, in bytes per second.
  void measure_sweeps(double memory_bandwidth, Table& table) {
    std::vector<Sweep> sweeps;
    for (const Form& form : forms_) {
      add_gather(form, sweeps);
      if (form.sweepable() == nullptr) continue;
      add_relaxation(form, SweepOrder::kForward, sweeps);
      add_relaxation(form, SweepOrder::kSymmetric, sweeps);
    }
    std::vector<TimedCase> cases;
    for (const Sweep& sweep : sweeps) {
      cases.push_back({.work = [&sweep] { sweep.stored->read(); }});
      cases.push_back({.work = sweep.work});
    }
    const std::vector<Timing> timings =
        time_interleaved(cases, {.rounds = options_.common.repeats});
    for (std::size_t k = 0; k < sweeps.size(); ++k) {
      const double read = timings[2 * k].median, time = timings[2 * k + 1].median;
      const auto bytes = static_cast<double>(sweeps[k].bytes),
                 stored = static_cast<double>(sweeps[k].stored_bytes);
      table.add({scene_name(data_), data_.patches.size(), sweeps[k].form, sweeps[k].name,
                 sweeps[k].bytes, bytes / static_cast<double>(data_.patches.size()), time * 1e6,
                 timings[2 * k + 1].spread, bytes / time / 1e9, stored / read / 1e9,
                 bytes / stored * read / time, memory_bandwidth / 1e9,
                 bytes / time / memory_bandwidth});
    }
  }

  /// A row for each form, method and change of the light.
  void measure_solves(Table& table) {
    for (const Form& form : forms_) {
      if (form.name == "rows") continue;  // nobody iterates on it: see the sweeps
      for (const NamedSolveMethod& named : kSolveMethods) {
        if (named.method == SolveMethod::kJacobi) continue;  // gathering
        if (sweeps_over_rows(named.method) && form.sweepable() == nullptr) continue;
        const auto solver =
            make_solver(named.method, *form.form_factors,
                        {data_.patches.area, data_.patches.reflectance}, data_.transfer);
        for (const LightChange& change : changes_)
          measure_solve(form, named, change, *solver, table);
      }
    }
  }

  /// The product with the stored operator, for comparison.
  void measure_transfer(Table& table) {
    std::vector<Float3> result(data_.patches.size());
    std::vector<float> workspace(data_.transfer->workspace_size());
    const std::vector<TimedCase> cases = {
        {.work = [&] { data_.transfer->apply(changes_[0].after, result, workspace); }}};
    const Timing time = time_interleaved(cases, {.rounds = options_.common.repeats})[0];
    table.add({scene_name(data_), data_.patches.size(), data_.transfer->kind(), "transfer", "any",
               data_.record.error_mean, Table::Cell(), time.median * 1e6, Table::Cell(),
               Table::Cell(), Table::Cell(), Table::Cell()});
  }

 private:
  struct Sweep {
    std::string form, name;
    std::size_t bytes;         ///< of F that it reads, what it reads twice counted twice
    std::size_t stored_bytes;  ///< of F
    std::function<void()> work;
    std::shared_ptr<ReadBuffer> stored;  ///< as large as F
  };

  void add_gather(const Form& form, std::vector<Sweep>& sweeps) const {
    const auto out = std::make_shared<std::vector<Float3>>(data_.patches.size());
    const auto workspace =
        std::make_shared<std::vector<float>>(form.form_factors->workspace_size());
    const std::size_t stored = form.form_factors->bytes();
    sweeps.push_back({form.name, "gather", form.form_factors->bytes_per_gather(), stored,
                      [this, &form, out, workspace] {
                        form.form_factors->gather(changes_[0].after, *out, *workspace);
                      },
                      std::make_shared<ReadBuffer>(stored)});
  }

  void add_relaxation(const Form& form, SweepOrder order, std::vector<Sweep>& sweeps) const {
    const std::shared_ptr<Relaxation> relaxation = form.sweepable()->make_relaxation();
    relaxation->begin({data_.patches.area, data_.patches.reflectance, changes_[0].after},
                      changes_[0].after);
    const std::size_t stored = form.form_factors->bytes();
    const std::size_t bytes = stored * relaxation->reads_per_sweep(order);
    const bool symmetric = order == SweepOrder::kSymmetric;
    const auto backward = std::make_shared<bool>(false);
    sweeps.push_back(
        {form.name, symmetric ? "symmetric-gauss-seidel" : "gauss-seidel", bytes, stored,
         [relaxation, symmetric, backward] {
           relaxation->sweep(*backward ? SweepDirection::kBackward : SweepDirection::kForward);
           if (symmetric) *backward = !*backward;
         },
         std::make_shared<ReadBuffer>(stored)});
  }

  static SolveSettings exactly(int sweeps) {
    return {.max_sweeps = sweeps, .residual = 0, .measure_residual = false};
  }

  std::vector<Float3> solution(const Form& form, const std::vector<Float3>& light) const {
    std::vector<Float3> radiosity(light.size());
    solve_radiosity(SolveMethod::kConjugateGradient, *form.form_factors,
                    {data_.patches.area, data_.patches.reflectance}, light,
                    {.max_sweeps = 1000, .residual = 1e-7}, radiosity);
    return radiosity;
  }

  double error(std::span<const Float3> radiosity, const std::vector<Float3>& truth,
               const std::vector<Float3>& light) const {
    return reflected_error(radiosity, truth, light, data_.patches.area);
  }

  void measure_solve(const Form& form, const NamedSolveMethod& named, const LightChange& change,
                     RadiositySolver& solver, Table& table) const {
    const std::vector<Float3> truth = solution(form, change.after);
    const std::vector<Float3> before =
        change.before.empty() ? change.before : solution(form, change.before);
    const auto prepare = [&] {
      if (before.empty()) {
        solver.reset();
      } else {
        solver.start_from(before);
      }
    };
    std::array<int, kErrors.size()> needed{};
    std::size_t reached = 0;
    for (int sweeps = 1; sweeps <= kMostSweeps && reached < kErrors.size(); ++sweeps) {
      prepare();
      solver.solve(change.after, exactly(sweeps));
      const double e = error(solver.radiosity(), truth, change.after);
      while (reached < kErrors.size() && e <= kErrors[reached]) needed[reached++] = sweeps;
    }
    std::vector<TimedCase> cases;
    for (std::size_t k = 0; k < reached; ++k) {
      cases.push_back(
          {.work = [&, k] { solver.solve(change.after, exactly(needed[k])); }, .prepare = prepare});
    }
    const std::vector<Timing> timings =
        time_interleaved(cases, {.rounds = options_.common.repeats});
    std::vector<Table::Cell> row = {scene_name(data_), data_.patches.size(),
                                    form.name,         std::string(named.name),
                                    change.name,       form_error(form, change.after, truth)};
    for (std::size_t k = 0; k < kErrors.size(); ++k) {
      row.push_back(k < reached ? Table::Cell(needed[k]) : Table::Cell());
      row.push_back(k < reached ? Table::Cell(timings[k].median * 1e6) : Table::Cell());
    }
    table.add(std::move(row));
  }

  /// What the form itself adds: the error of its solution against that of the F of all pairs.
  Table::Cell form_error(const Form& form, const std::vector<Float3>& light,
                         const std::vector<Float3>& truth) const {
    if (form.name != "compressed" && form.name != "links") return 0.0;
    const auto exact = std::ranges::find(forms_, "blocks", &Form::name);
    if (exact == forms_.end()) return {};
    return error(truth, solution(*exact, light), light);
  }

  const TransferData& data_;
  const SolverOptions& options_;
  std::vector<Form> forms_;
  std::vector<LightChange> changes_;
};

void run(const SolverOptions& options) {
  Table sweeps({"scene", "patches", "form", "sweep", "bytes", "per patch", "microseconds", "spread",
                "GB/s", "read GB/s", "of read", "memory GB/s", "of memory"});
  Table solves({"scene", "patches", "form", "method", "light", "form error", "sweeps 1 %", "us 1 %",
                "sweeps 0.1 %", "us 0.1 %", "sweeps 0.01 %", "us 0.01 %"});
  const double memory_bandwidth = measure_memory_bandwidth();
  for (const std::string& input : options.inputs) {
    const TransferData data = load_or_build(input, options.settings);
    SolverBenchmark benchmark(data, options);
    benchmark.measure_sweeps(memory_bandwidth, sweeps);
    if (options.sweeps_only) continue;
    benchmark.measure_transfer(solves);
    benchmark.measure_solves(solves);
  }
  publish("sweeps", sweeps, options.common);
  if (options.sweeps_only) return;
  CommonOptions of_solves = options.common;
  of_solves.csv = options.solve_csv;
  of_solves.json.clear();
  publish("solves", solves, of_solves);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::SolverOptions options;
  options.settings.store_form_factors = true;
  options.settings.form_factor_tolerance = rebounce::bench::kDefaultTolerance;
  CLI::App app("Times sweeps and solves of the iterative methods on each form of F.",
               "bench_solvers");
  rebounce::bench::add_input_option(app, options.inputs);
  rebounce::bench::add_patch_option(app, options.settings.subdivision.patch_count);
  app.add_option("--form-factor-tolerance", options.settings.form_factor_tolerance,
                 "Error of the compressed form factors, where the input holds none")
      ->check(CLI::Range(1e-5, 0.5))
      ->capture_default_str();
  app.add_flag("--sweeps-only", options.sweeps_only, "No solves, which take longest");
  app.add_option("--solve-csv", options.solve_csv, "Write the solves to this file, as CSV");
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}

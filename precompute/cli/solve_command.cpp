#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "precompute/base/csv_writer.h"
#include "precompute/base/npz_writer.h"
#include "precompute/cli/chosen_lights.h"
#include "precompute/cli/commands.h"
#include "precompute/cli/frame_cost.h"
#include "precompute/cli/method_names.h"
#include "precompute/cli/output_check.h"
#include "rebounce/error.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/base/area_norm.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce::cli {
namespace {

// The names of the forms of F.
constexpr const char *kExact = "exact", *kCompressed = "compressed", *kLinks = "links";
constexpr const char* kNoFormFactors = "none";

struct SolveOptions {
  std::string file, lights, method = kTransferMethod, form_factors, output;
  SolveSettings settings;
};

struct Solution {
  std::vector<Float3> indirect_irradiance, radiosity;
  int sweeps = 0;
  bool diverged = false;
  double microseconds = 0;
};

Solution solve_by_transfer(Engine& engine) {
  Solution solution;
  solution.microseconds = median_microseconds(
      [&] { return microseconds_of([&] { engine.parts().apply_transfer(); }); });
  engine.parts().compute_radiosity();
  solution.indirect_irradiance.assign(engine.indirect_irradiance().begin(),
                                      engine.indirect_irradiance().end());
  solution.radiosity.assign(engine.radiosity().begin(), engine.radiosity().end());
  return solution;
}

Solution solve_by_iteration(RadiositySolver& solver, const Engine& engine,
                            const FormFactorOperator& form_factors, const SolveSettings& settings) {
  Solution solution;
  SolveResult result;
  solution.microseconds = median_microseconds([&] {
    solver.reset();
    result = solver.solve(engine.initial_exitance(), settings);
    return result.microseconds;
  });
  solution.sweeps = result.sweeps;
  solution.diverged = result.diverged;
  solution.radiosity.assign(solver.radiosity().begin(), solver.radiosity().end());
  solution.indirect_irradiance = gather(form_factors, solution.radiosity);
  return solution;
}

/// |M0 + rho F B - B| / |M0| in the area-weighted norm.
double radiosity_residual(const Engine& engine, const FormFactorOperator& form_factors,
                          const std::vector<Float3>& radiosity) {
  const PatchTable& patches = engine.data().patches;
  std::vector<Float3> rest = gather(form_factors, radiosity);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      rest[i][c] = engine.initial_exitance()[i][c] + patches.reflectance[i][c] * rest[i][c] -
                   radiosity[i][c];
    }
  }
  const double norm = area_norm(engine.initial_exitance(), patches.area);
  return norm > 0 ? area_norm(rest, patches.area) / norm : 0;
}

/// The error of a solution by the form factors `kind` of the file; none where the operator does not
/// serve all patches, or there is none.
std::optional<ErrorEstimate> error_of(const Engine& engine, const std::string& kind,
                                      std::span<const Float3> indirect_irradiance) {
  const TransferData& data = engine.data();
  if (kind == kNoFormFactors || !data.transfer) return std::nullopt;
  if (!data.transfer->roles().all_are_both()) return std::nullopt;
  const FormFactorSource source = kind == kLinks        ? FormFactorSource::kLinks
                                  : kind == kCompressed ? FormFactorSource::kCompressed
                                                        : FormFactorSource::kExact;
  return ErrorEstimator(engine.shared_data(), source)
      .estimate_error(engine.initial_exitance(), indirect_irradiance, engine.scheduler());
}

/// A number of an estimate in JSON, which knows no infinity.
nlohmann::json number_or_null(const std::optional<ErrorEstimate>& estimate,
                              double ErrorEstimate::*number) {
  if (!estimate || !std::isfinite((*estimate).*number)) return nullptr;
  return (*estimate).*number;
}

std::span<const float> as_floats(std::span<const Float3> values) {
  return {values.empty() ? nullptr : values.front().data(), values.size() * kChannelCount};
}

void write_solution(const std::string& path, const Engine& engine, const Solution& solution) {
  const std::array<std::pair<std::string, std::span<const Float3>>, 3> arrays = {
      {{"direct_irradiance", engine.direct_irradiance()},
       {"indirect_irradiance", solution.indirect_irradiance},
       {"radiosity", solution.radiosity}}};
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".npz") {
    std::vector<NumpyArray> npz;
    for (const auto& [name, values] : arrays) npz.push_back(numpy_array(name, values));
    write_npz(path, npz);
    return;
  }
  std::vector<CsvColumns> columns;
  for (const auto& [name, values] : arrays) {
    columns.push_back({{name + "_r", name + "_g", name + "_b"}, as_floats(values)});
  }
  write_csv(path, columns);
}

/// The method of --method; for the product, the method that reads F least.
SolveMethod method_of(const SolveOptions& chosen) {
  if (chosen.method == kHierarchicalMethod) return SolveMethod::kJacobi;
  const auto* named = std::ranges::find(kSolveMethods, chosen.method, &NamedSolveMethod::name);
  return named == kSolveMethods.end() ? SolveMethod::kSymmetricGaussSeidel : named->method;
}

/// `form_factors` may be null for the product.
Solution find_solution(const SolveOptions& chosen, Engine& engine,
                       const FormFactorOperator* form_factors) {
  if (chosen.method == kTransferMethod) return solve_by_transfer(engine);
  const TransferData& data = engine.data();
  const auto solver = make_solver(method_of(chosen), *form_factors,
                                  {data.patches.area, data.patches.reflectance}, data.transfer);
  return solve_by_iteration(*solver, engine, *form_factors, chosen.settings);
}

/// The form that was asked for, or the best one that the file holds; hierarchical radiosity needs
/// links, and the product alone needs no form factors.
std::string form_factors_of(const SolveOptions& chosen, const TransferData& data) {
  const bool hierarchical = chosen.method == kHierarchicalMethod;
  if (hierarchical && !chosen.form_factors.empty() && chosen.form_factors != kLinks) {
    throw Error("--method hierarchical always uses links; leave out --form-factors");
  }
  std::string asked = hierarchical ? kLinks : chosen.form_factors;
  if (asked == kLinks && data.links.empty()) {
    throw Error(chosen.file + " has no links; make it again with precompute --store-links");
  }
  if (asked == kCompressed && !data.compressed_form_factors) {
    throw Error(chosen.file +
                " has no compressed form factors; make it again with precompute "
                "--compress-form-factors");
  }
  if (asked == kExact && data.exchange.empty()) {
    throw Error(chosen.file +
                " has no exact form factors; make it again with precompute "
                "--store-form-factors");
  }
  if (!asked.empty()) return asked;
  if (!data.exchange.empty()) return kExact;
  if (data.compressed_form_factors) return kCompressed;
  if (chosen.method == kTransferMethod) return kNoFormFactors;
  throw Error(chosen.file + " has no form factors, which " + chosen.method +
              " needs; make it again with precompute --store-form-factors or "
              "--compress-form-factors");
}

/// Null for kNoFormFactors.
std::unique_ptr<const FormFactorOperator> choose_form_factors(const std::string& kind,
                                                              SolveMethod method,
                                                              const TransferData& data) {
  if (kind == kNoFormFactors) return nullptr;
  if (kind == kLinks) {
    return std::make_unique<LinkedFormFactors>(data.links, data.patches.area,
                                               data.patches.centroid);
  }
  if (kind == kCompressed) {
    return std::make_unique<CompressedFormFactors>(data.compressed_form_factors);
  }
  return make_form_factors(method, data);
}

/// What is said of a solution beside the method's own figures.
struct SolveReport {
  std::string form_factors;
  std::optional<double> residual;      ///< none without form factors
  std::optional<ErrorEstimate> error;  ///< none where it cannot be told
  FrameFlux flux;
  double direct_microseconds = 0;
};

void print_summary(const SolveOptions& chosen, const SolveReport& report, const Solution& solution,
                   const CommonOptions& options) {
  const auto& residual = report.residual;
  if (options.json) {
    const nlohmann::json summary = {
        {"method", chosen.method},
        {"form_factors", report.form_factors},
        {"sweeps", solution.sweeps},
        {"residual", residual ? nlohmann::json(*residual) : nullptr},
        {"error_estimate", number_or_null(report.error, &ErrorEstimate::error)},
        {"error_bound", number_or_null(report.error, &ErrorEstimate::bound)},
        {"microseconds", solution.microseconds},
        {"direct_microseconds", report.direct_microseconds},
        {"lumens", as_json(report.flux)}};
    print_json(summary);
  } else if (!options.quiet) {
    fmt::print("{}\n", described(report.flux));
    const std::string sweeps =
        solution.sweeps > 0 ? fmt::format(", {} sweeps", solution.sweeps) : "";
    fmt::print("direct light {:.2f} ms, all lamps anew; indirect light by {} {:.3f} ms{}\n",
               report.direct_microseconds / 1e3, chosen.method, solution.microseconds / 1e3,
               sweeps);
    fmt::print("{}\n", residual ? fmt::format("residual {:.2e}", *residual)
                                : "no residual: the file has no form factors (precompute "
                                  "--store-form-factors)");
    if (report.error) {
      fmt::print("error of the indirect light {:.2e}, at most {:.2e}\n", report.error->error,
                 report.error->bound);
    }
  }
}

void run(const SolveOptions& chosen, const CommonOptions& options) {
  check_can_write(chosen.output);
  LightSetup setup;
  const auto data = load_lit_scene(chosen.file, chosen.lights, setup);
  Engine engine(data);
  const double direct_microseconds =
      microseconds_of([&] { engine.parts().compute_direct(setup.lights, setup.sky); });
  engine.parts().compute_initial_exitance();
  warn_of_lamps(engine, setup.lights, options);
  const std::string kind = form_factors_of(chosen, *data);
  const auto form_factors = choose_form_factors(kind, method_of(chosen), *data);
  const Solution solution = find_solution(chosen, engine, form_factors.get());
  if (solution.diverged) {
    throw Error(chosen.method + " diverges: the operator of " + chosen.file +
                " does not fit its form factors; use another method, such as "
                "conjugate-gradient");
  }
  std::optional<double> residual;
  if (form_factors) residual = radiosity_residual(engine, *form_factors, solution.radiosity);
  write_solution(chosen.output, engine, solution);
  print_summary(chosen,
                {.form_factors = kind,
                 .residual = residual,
                 .error = error_of(engine, kind, solution.indirect_irradiance),
                 .flux = flux_of(engine, solution.indirect_irradiance),
                 .direct_microseconds = direct_microseconds},
                solution, options);
}

}  // namespace

void add_solve_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<SolveOptions>();
  CLI::App* command = app.add_subcommand("solve", "Relight a transfer file once");
  command->add_option("file", chosen->file, "Transfer file")->required();
  command->add_option("--lights", chosen->lights,
                      "Lights: .json, or a .glb that has some; by default those of the scene");
  command->add_option("--method", chosen->method, "How to find the indirect light")
      ->check(CLI::IsMember(method_names()))
      ->capture_default_str();
  command
      ->add_option("--form-factors", chosen->form_factors,
                   "Form factors of iterative methods: exact ones of pairs, compressed ones, or "
                   "links; by default exact ones if the file holds them")
      ->check(CLI::IsMember({kExact, kCompressed, kLinks}));
  command
      ->add_option("--iterations", chosen->settings.max_sweeps,
                   "Largest number of sweeps of an iterative method")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command
      ->add_option(
          "--residual", chosen->settings.residual,
          "Stop an iterative method when its residual is this fraction of the initial exitance")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      ->add_option(
          "--time-budget", chosen->settings.time_budget_microseconds,
          "Start no sweep of an iterative method after this many microseconds; 0: no limit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("-o,--output", chosen->output, "Result: .npz or .csv, each array [n,3]")
      ->required()
      ->check([](const std::string& path) {
        const std::string extension = std::filesystem::path(path).extension().string();
        return extension == ".npz" || extension == ".csv" ? "" : "must end in .npz or .csv";
      });
  command->callback([chosen, &options] { run(*chosen, options); });
}

}  // namespace rebounce::cli

// Hierarchical radiosity on links against sweeps on F of all pairs of the same patches: time to the
// same error, and how the time of a sweep grows with the number of patches.

#include <CLI/CLI.hpp>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "bench/bounced_light.h"
#include "bench/input.h"
#include "bench/program.h"
#include "bench/timing.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/exchange/links/link_fitting.h"
#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/lights/random_lights.h"
#include "runtime/solvers/conjugate_gradient_solver.h"
#include "runtime/solvers/gathering_solver.h"
#include "runtime/solvers/gauss_seidel_solver.h"
#include "runtime/solvers/hierarchical_solver.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/error.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/file/transfer_file.h"

namespace rebounce::bench {
namespace {

constexpr int kMostSweeps = 100;
constexpr int kSweepsToConverge = 40;  // for what links leave: an error that no sweep mends
constexpr int kSweepsWithoutTruth = 8;

struct HierarchicalOptions {
  std::vector<std::string> scenes;
  std::vector<std::size_t> patches = {4000, 16000};
  std::vector<double> epsilons = {kLinkEpsilon};
  std::vector<double> worths = {kErrorPerLink};  ///< what fitted links must be worth
  std::vector<double> compression = {1e-3};      ///< errors of F B to which F is compressed
  std::string pairs;              ///< transfer file with F of all pairs; empty: they are found
  std::size_t most_flat = 20000;  ///< patches of which F of all pairs is found
  int light_count = 4;            ///< of each kind
  double error = 0.01;
  CommonOptions common{.repeats = 7};
};

/// Light and the indirect irradiance that it makes by F of all pairs.
struct LightCase {
  std::vector<Float3> initial_exitance, indirect_irradiance;
};

/// One method on one form of F.
struct Contender {
  std::string method, form;
  double epsilon = 0;    ///< of links that were refined; 0: from all pairs
  double tolerance = 0;  ///< worth of fitted links, or error of compressed F
  std::size_t entry_count = 0;
  const FormFactorOperator* form_factors = nullptr;
  std::unique_ptr<RadiositySolver> solver;
  int sweeps = kSweepsWithoutTruth;
  std::optional<double> error{}, converged_error{};
};

class HierarchicalBench {
 public:
  HierarchicalBench(const std::string& scene, std::size_t patch_count,
                    const HierarchicalOptions& options)
      : options_(options),
        scene_(scene_name(scene)),
        model_(model_of_scene(scene, patch_count)),
        tracer_(make_surface_tracer(model_.mesh)) {
    draw_lights();
    if (model_.patches.size() <= options.most_flat) add_flat();
    for (const double epsilon : options.epsilons) add_links(epsilon);
    for (Contender& contender : contenders_) count_sweeps(contender);
  }

  /// `sweep_before` holds the patches and the seconds of a sweep of the scene before, by method.
  using SweepTimes = std::map<std::string, std::pair<double, double>>;
  void measure(int threads, SweepTimes& sweep_before, Table& table) {
    std::vector<TimedCase> cases;
    for (const Contender& contender : contenders_) {
      cases.push_back({.work = [&] { solve_all(contender, contender.sweeps); }});
    }
    const std::vector<Timing> timings =
        time_interleaved(cases, {.rounds = options_.common.repeats});
    const auto n = static_cast<double>(model_.patches.size());
    for (std::size_t k = 0; k < contenders_.size(); ++k) {
      const Contender& contender = contenders_[k];
      const double seconds = timings[k].minimum / static_cast<double>(lights_.size());
      const double sweep = seconds / contender.sweeps;
      Table::Cell ratio, growth;
      if (!flat_.empty()) ratio = timings[k].minimum / timings[0].minimum;
      const std::string key = contender.method + contender.form +
                              std::to_string(contender.epsilon) +
                              std::to_string(contender.tolerance) + std::to_string(threads);
      if (const auto before = sweep_before.find(key); before != sweep_before.end()) {
        growth = std::log(sweep / before->second.second) / std::log(n / before->second.first);
      }
      sweep_before[key] = {n, sweep};
      table.add({scene_, n, threads, contender.method, contender.form,
                 contender.epsilon > 0 ? Table::Cell(contender.epsilon) : Table::Cell(),
                 contender.tolerance > 0 ? Table::Cell(contender.tolerance) : Table::Cell(),
                 static_cast<double>(contender.entry_count) / (n * n),
                 static_cast<double>(contender.form_factors->bytes()) / n,
                 cell(contender.converged_error), contender.sweeps, cell(contender.error),
                 seconds * 1e3, sweep * 1e3, ratio, growth});
    }
  }

 private:
  static Table::Cell cell(const std::optional<double>& value) {
    return value ? Table::Cell(*value) : Table::Cell();
  }

  RadiosityProblem problem() const { return {model_.patches.area, model_.patches.reflectance}; }

  void draw_lights() {
    TransferData data;
    data.patches = model_.patches;
    data.patches.sky_visibility.assign(data.patches.size(), 0);  // no light of these is a sky
    data.mesh = model_.mesh;
    for (const LightKind kind : {LightKind::kPoint, LightKind::kPatch}) {
      for (auto& light : random_initial_exitances(data, tracer_, kind, options_.light_count, 1)) {
        lights_.push_back({std::move(light), {}});
      }
    }
    fitting_ = draw_fitting_lights(data, tracer_, 1);
  }

  ExchangeMatrix find_pairs() const {
    if (options_.pairs.empty()) return compute_form_factors(model_, tracer_).exchange;
    const TransferData data = load_transfer_file(options_.pairs);
    if (data.exchange.patch_count() != model_.patches.size() ||
        data.patches.area != model_.patches.area) {
      throw Error(options_.pairs + ": not the form factors of these patches");
    }
    return data.exchange;
  }

  void add_flat() {
    exchange_ = find_pairs();
    const std::size_t entries = 2 * exchange_.column.size();
    auto blocks = std::make_unique<FormFactorBlocks>(exchange_, model_.patches.area);
    auto half = std::make_unique<ExchangeBlocks>(exchange_, model_.patches.area);
    add({"gauss-seidel", "blocks", 0, 0, entries, blocks.get(),
         std::make_unique<GaussSeidelSolver>(*blocks, problem())});
    add({"symmetric-gauss-seidel", "exchange", 0, 0, entries, half.get(),
         std::make_unique<GaussSeidelSolver>(*half, problem(), SweepOrder::kSymmetric)});
    add({"gathering", "exchange", 0, 0, entries, half.get(),
         std::make_unique<GatheringSolver>(*half, problem())});
    add({"conjugate-gradient", "exchange", 0, 0, entries, half.get(),
         std::make_unique<ConjugateGradientSolver>(*half, problem())});
    RadiositySolver& exact = *contenders_.back().solver;
    for (LightCase& light : lights_) {
      exact.reset();
      exact.solve(light.initial_exitance, {.residual = 1e-7});
      light.indirect_irradiance = indirect_irradiance(exact, light);
    }
    flat_.push_back(std::move(blocks));
    flat_.push_back(std::move(half));
    add_compressed(exchange_, *flat_.front());
    for (const double worth : options_.worths) {
      add_hierarchical("fitted links", 0, worth, fit_links(exchange_, model_.patches, worth));
    }
  }

  void add_links(double epsilon) {
    FormFactorSettings settings;
    settings.link_epsilon = epsilon;
    const FormFactorLinks links = build_links(model_, tracer_, settings).links;
    const PatchTable& patches = model_.patches;
    if (flat_.empty()) {
      add_compressed(links, LinkedFormFactors(links, patches.area, patches.centroid));
    }
    for (const double worth : options_.worths) {
      add_hierarchical("links", epsilon, worth, fit_links(links, patches, worth));
    }
  }

  /// Hierarchical radiosity and conjugate gradients on `links`.
  void add_hierarchical(const char* form, double epsilon, double worth,
                        const FormFactorLinks& links) {
    const std::size_t count = links.pair.size();
    linked_.push_back(
        std::make_unique<LinkedFormFactors>(links, model_.patches.area, model_.patches.centroid));
    const LinkedFormFactors& linked = *linked_.back();
    add({"hierarchical", form, epsilon, worth, count, &linked,
         std::make_unique<HierarchicalSolver>(linked, problem())});
    add({"conjugate-gradient", form, epsilon, worth, count, &linked,
         std::make_unique<ConjugateGradientSolver>(linked, problem())});
  }

  /// Sweeps on compressed F, from pairs or links; `product` is a product with the same F.
  template <typename FormFactors>
  void add_compressed(const FormFactors& form_factors, const FormFactorOperator& product) {
    for (const double tolerance : options_.compression) {
      const auto made = compress_form_factors(form_factors, model_.patches,
                                              bounced(fitting_, product, model_.patches).view(),
                                              {tolerance, Precision::kF16});
      compressed_.push_back(std::make_unique<CompressedFormFactors>(made));
      const CompressedFormFactors& form = *compressed_.back();
      const std::size_t numbers = made->bytes() / sizeof(std::uint16_t);
      add({"gauss-seidel", "compressed", 0, tolerance, numbers, &form,
           std::make_unique<GaussSeidelSolver>(form, problem())});
      add({"gathering", "compressed", 0, tolerance, numbers, &form,
           std::make_unique<GatheringSolver>(form, problem())});
    }
  }

  void add(Contender contender) { contenders_.push_back(std::move(contender)); }

  /// What a solution says arrives from other patches: (B - M0) / rho, 0 where nothing is reflected.
  std::vector<Float3> indirect_irradiance(const RadiositySolver& solver,
                                          const LightCase& light) const {
    std::vector<Float3> result(light.initial_exitance.size());
    for (std::size_t i = 0; i < result.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        const float rho = model_.patches.reflectance[i][c];
        const float reflected = solver.radiosity()[i][c] - light.initial_exitance[i][c];
        result[i][c] = rho > 0 ? reflected / rho : 0;
      }
    }
    return result;
  }

  static void solve(const Contender& contender, const LightCase& light, int sweeps) {
    contender.solver->reset();
    contender.solver->solve(light.initial_exitance,
                            {.max_sweeps = sweeps, .residual = 0, .measure_residual = false});
  }

  void solve_all(const Contender& contender, int sweeps) const {
    for (const LightCase& light : lights_) solve(contender, light, sweeps);
  }

  /// The mean over the lights, area-weighted L2.
  double error_after(const Contender& contender, int sweeps) const {
    double sum = 0;
    for (const LightCase& light : lights_) {
      solve(contender, light, sweeps);
      sum += relative_difference(indirect_irradiance(*contender.solver, light),
                                 light.indirect_irradiance, model_.patches.area);
    }
    return sum / static_cast<double>(lights_.size());
  }

  void count_sweeps(Contender& contender) const {
    if (flat_.empty()) return;
    contender.converged_error = error_after(contender, kSweepsToConverge);
    if (*contender.converged_error > options_.error) return;
    for (contender.sweeps = 1; contender.sweeps < kMostSweeps; ++contender.sweeps) {
      contender.error = error_after(contender, contender.sweeps);
      if (*contender.error <= options_.error) return;
    }
  }

  const HierarchicalOptions& options_;
  std::string scene_;
  PatchModel model_;
  RayTracer tracer_;
  std::vector<LightCase> lights_;
  DrawnLights fitting_;  ///< for compression
  ExchangeMatrix exchange_;
  std::vector<std::unique_ptr<FormFactorOperator>> flat_;
  std::vector<std::unique_ptr<CompressedFormFactors>> compressed_;
  std::vector<std::unique_ptr<LinkedFormFactors>> linked_;
  std::vector<Contender> contenders_;
};

void run(const HierarchicalOptions& options) {
  Table table({"scene", "patches", "threads", "method", "form", "epsilon", "tolerance",
               "entries / n2", "bytes a patch", "converged", "sweeps", "error", "ms", "ms a sweep",
               "of gauss-seidel", "growth"});
  for (const std::string& scene : options.scenes) {
    HierarchicalBench::SweepTimes sweep_before;
    for (const std::size_t patches : options.patches) {
      HierarchicalBench bench(scene, patches, options);
      run_at_thread_counts(options.common,
                           [&](int threads) { bench.measure(threads, sweep_before, table); });
    }
  }
  publish("hierarchical", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  using namespace rebounce::bench;
  HierarchicalOptions options;
  CLI::App app("Hierarchical radiosity beside sweeps on the form factors of all pairs",
               "bench_hierarchical");
  add_scene_option(app, options.scenes);
  add_patches_option(app, options.patches);
  app.add_option("--epsilon", options.epsilons, "Errors that a link may have")
      ->capture_default_str();
  app.add_option("--worth", options.worths,
                 "What links fitted to all pairs, or to refined links, must be worth")
      ->capture_default_str();
  app.add_option("--compress", options.compression, "Errors of F B to which F is compressed")
      ->capture_default_str();
  app.add_option("--pairs", options.pairs,
                 "Transfer file whose form factors of all pairs are taken instead of finding them: "
                 "of the one scene and number of patches that is measured")
      ->check(CLI::ExistingFile);
  app.add_option("--most-flat", options.most_flat,
                 "With more patches than this, links alone are found and timed")
      ->capture_default_str();
  app.add_option("--lights", options.light_count, "Random lights of each kind")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--error", options.error, "Error of indirect irradiance to solve to")
      ->check(CLI::Range(1e-6, 1.0))
      ->capture_default_str();
  add_common_options(app, options.common);
  return run_program(app, argc, argv, options.common, [&] { run(options); });
}

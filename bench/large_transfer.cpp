// Operators without any matrix of all pairs: processor seconds of the stages, bytes and errors,
// beside the way over the dense inverse of the same form factors where that is not too large.

#include "precompute/compression/matrix_free_transfer.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <numeric>

#include "bench/bounced_light.h"
#include "bench/input.h"
#include "bench/process_cost.h"
#include "bench/program.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/exchange/links/linked_matrix.h"
#include "precompute/exchange/links/links.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/inverse/hierarchical_matrix.h"
#include "precompute/inverse/solved_transfer.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/lights/random_lights.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/reflection.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce::bench {
namespace {

struct LargeOptions {
  std::vector<std::string> scenes;
  std::vector<std::size_t> patches = {1000, 4000};
  double tolerance = kDefaultTolerance;
  double form_factor_tolerance = 3e-4;
  std::size_t dense_limit = 6000;  ///< patches with which the dense way is gone too
  std::vector<double> residuals;
  std::string checkpoint;
  CommonOptions common{.repeats = 1};
};

double peak_gib() {
  return static_cast<double>(peak_memory_bytes()) / 0x1p30;
}

using Lights = std::vector<std::vector<Float3>>;

struct Errors {
  double mean = 0, max = 0;
};

class SceneBench {
 public:
  SceneBench(const std::string& path, std::size_t patch_count, const LargeOptions& options)
      : options_(options) {
    const PatchModel model = model_of_scene(path, patch_count);
    const RayTracer tracer = make_surface_tracer(model.mesh);
    data_.patches = model.patches;
    data_.mesh = model.mesh;
    // Closed scenes: nothing escapes.
    data_.patches.sky_visibility.assign(model.patches.size(), 0);
    data_.patches.absorbed.assign(model.patches.size(), 0);
    link_seconds_ = processor_seconds_of(
        [&] { links_ = build_links(model, tracer, {.link_epsilon = kLinkEpsilon}).links; });
    lights_ = draw_fitting_lights(data_, tracer, 1);
    test_lights_ = random_initial_exitances(data_, tracer, LightKind::kPoint, 64, 77);
  }

  void measure(const std::string& name, Table& table) {
    compress_form_factors_of_links();
    const SolvedTransfer exact(*form_factors_, data_.patches, 1e-6);
    const Lights truth = products(exact);
    for (const double residual : options_.residuals) try_residual(exact, residual);
    MatrixFreeTransferSettings settings{.compression = {.tolerance = options_.tolerance},
                                        .checkpoint = options_.checkpoint};
    std::shared_ptr<const HierarchicalOperator> large;
    const Progress progress = [last = 0.0, this](double done) mutable {
      if (done >= last + 0.05) {
        std::fprintf(stderr, "%.2f %.1f s %.2f GiB\n", done, processor_seconds(), peak_gib());
        last = done;
      }
      return true;
    };
    const double seconds = processor_seconds_of([&] {
      large = build_matrix_free_transfer(*form_factors_, data_.patches, lights_.view(), settings,
                                         progress);
    });
    add(name, "large", *large, seconds, truth, table);
    if (data_.patches.size() <= options_.dense_limit) measure_dense(name, truth, table);
  }

 private:
  void compress_form_factors_of_links() {
    const double seconds = processor_seconds_of([&] {
      const LinkedFormFactors product(links_, data_.patches.area, data_.patches.centroid);
      const DrawnLights fitting = bounced(lights_, product, data_.patches);
      const double before = processor_seconds();
      form_factors_ = compress_form_factors(links_, data_.patches, fitting.view(),
                                            {options_.form_factor_tolerance, Precision::kF16});
      std::fprintf(stderr, "compression of F alone %.1f s\n", processor_seconds() - before);
    });
    std::fprintf(
        stderr, "%zu patches, %zu links %.1f s, F %.1f s, %.0f bytes per patch, %.2f GiB\n",
        data_.patches.size(), links_.pair.size(), link_seconds_, seconds,
        static_cast<double>(form_factors_->bytes()) / static_cast<double>(data_.patches.size()),
        peak_gib());
  }

  Lights products(const SolvedTransfer& solved) const {
    Lights result(test_lights_.size(), std::vector<Float3>(data_.patches.size()));
    for (int c = 0; c < kChannelCount; ++c) {
      Eigen::MatrixXf x(data_.patches.size(), test_lights_.size());
      for (std::size_t k = 0; k < test_lights_.size(); ++k) {
        for (std::size_t i = 0; i < data_.patches.size(); ++i)
          x(i, k) = test_lights_[k][i][c] * std::sqrt(data_.patches.area[i]);
      }
      const Eigen::MatrixXf y = solved.multiply(solved.channel_matrix()[c], x);
      for (std::size_t k = 0; k < test_lights_.size(); ++k) {
        for (std::size_t i = 0; i < data_.patches.size(); ++i)
          result[k][i][c] = y(i, k) / std::sqrt(data_.patches.area[i]);
      }
    }
    return result;
  }

  /// Errors at a residual: of some columns, and of the light of all their patches together.
  void try_residual(const SolvedTransfer& exact, double residual) {
    const SolvedTransfer solved(*form_factors_, data_.patches, residual);
    const auto order = solved.patch();
    const std::size_t n = order.size(), count = SolvedTransfer::kBatchColumns;
    double error = 0, norm = 0, seconds = 0;
    Eigen::VectorXd sum, exact_sum;
    for (std::size_t begin = 0; begin + count <= n; begin += n / 4) {
      const auto patches = order.subspan(begin, count);
      SolvedTransfer::Vectors a, b;
      SolvedTransfer::Workspace workspace;
      seconds += processor_seconds_of([&] { a = solved.columns(0, patches, workspace); });
      b = exact.columns(0, patches, workspace);
      error += (a - b).cast<double>().squaredNorm();
      norm += b.cast<double>().squaredNorm();
      Eigen::VectorXf light(count);
      for (std::size_t k = 0; k < count; ++k) light[k] = std::sqrt(data_.patches.area[patches[k]]);
      const Eigen::VectorXf sa = a * light, sb = b * light;
      if (sum.size() == 0) sum = exact_sum = Eigen::VectorXd::Zero(a.rows());
      sum += sa.cast<double>();
      exact_sum += sb.cast<double>();
    }
    std::fprintf(stderr, "residual %g: columns %.2e, light of all of them %.2e, %.2f ms a column\n",
                 residual, std::sqrt(error / norm), (sum - exact_sum).norm() / exact_sum.norm(),
                 1e3 * seconds / (4.0 * static_cast<double>(count)));
  }

  Errors errors(const TransferOperator& transfer, const Lights& truth) const {
    std::vector<float> workspace(transfer.workspace_size());
    std::vector<Float3> h(data_.patches.size());
    Errors result;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      transfer.apply(test_lights_[k], h, workspace);
      const double e = relative_difference(h, truth[k], data_.patches.area);
      result.mean += e / static_cast<double>(truth.size());
      result.max = std::max(result.max, e);
    }
    return result;
  }

  void add(const std::string& name, const std::string& way, const TransferOperator& transfer,
           double seconds, const Lights& truth, Table& table) const {
    const Errors e = errors(transfer, truth);
    const auto n = static_cast<double>(data_.patches.size());
    table.add({name, n, way, seconds, static_cast<double>(transfer.bytes()) / n, e.mean, e.max,
               peak_gib()});
    std::fprintf(stderr, "%s %.0f %s: %.1f s, %.0f bytes per patch, %.4f %.4f, %.2f GiB\n",
                 name.c_str(), n, way.c_str(), seconds, static_cast<double>(transfer.bytes()) / n,
                 e.mean, e.max, peak_gib());
  }

  /// From all pairs of the same compressed form factors.
  void measure_dense(const std::string& name, const Lights& truth, Table& table) const {
    const HierarchicalMatrix g(form_factors_->storage());
    const std::size_t n = data_.patches.size();
    std::vector<std::uint32_t> all(n);
    std::iota(all.begin(), all.end(), 0U);
    Eigen::MatrixXf entries(n, n);
    g.entries(0, all, all, entries);
    std::vector<std::uint64_t> row_begin = {0};
    std::vector<std::uint32_t> column;
    std::vector<float> exchange;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = i; j < n; ++j) {
        column.push_back(j);
        exchange.push_back(entries(i, j) *
                           std::sqrt(data_.patches.area[i] * data_.patches.area[j]));
      }
      row_begin.push_back(column.size());
    }
    const ExchangeMatrix pairs{SharedArray(std::move(row_begin)), SharedArray(std::move(column)),
                               SharedArray(std::move(exchange))};
    std::shared_ptr<const HierarchicalOperator> compressed;
    std::shared_ptr<const DenseOperator> dense;
    const double seconds = processor_seconds_of([&] {
      dense = build_dense_transfer(pairs, data_.patches, Precision::kF32);
      std::fprintf(stderr, "dense inverse done\n");
      compressed = build_hierarchical_transfer(*dense, data_.patches, lights_.view(),
                                               {.tolerance = options_.tolerance});
    });
    const Errors inverse = errors(*dense, truth);
    std::fprintf(stderr, "dense against solved: %.2e %.2e\n", inverse.mean, inverse.max);
    add(name, "dense", *compressed, seconds, truth, table);
  }

  const LargeOptions& options_;
  TransferData data_;
  FormFactorLinks links_;
  double link_seconds_ = 0;
  DrawnLights lights_;
  Lights test_lights_;
  std::shared_ptr<const HierarchicalOperator> form_factors_;
};

void run(const LargeOptions& options) {
  Table table({"scene", "patches", "way", "processor_seconds", "bytes_per_patch", "error_mean",
               "error_max", "peak_gib"});
  for (const std::string& scene : options.scenes) {
    for (const std::size_t patches : options.patches) {
      SceneBench(scene, patches, options).measure(scene_name(scene), table);
    }
  }
  publish("bench_large", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::LargeOptions options;
  CLI::App app("Builds operators without any matrix of all pairs, and some by way of one.",
               "bench_large");
  rebounce::bench::add_scene_option(app, options.scenes);
  rebounce::bench::add_patches_option(app, options.patches);
  app.add_option("--tolerance", options.tolerance, "Error of the operator")->capture_default_str();
  app.add_option("--form-factor-tolerance", options.form_factor_tolerance, "Error of compressed F")
      ->capture_default_str();
  app.add_option("--dense-limit", options.dense_limit,
                 "Up to this many patches the dense way is gone too")
      ->capture_default_str();
  app.add_option("--residuals", options.residuals,
                 "Residuals to try on some columns, separated by commas")
      ->delimiter(',');
  app.add_option("--checkpoint", options.checkpoint, "Folder for finished panels");
  rebounce::bench::add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}

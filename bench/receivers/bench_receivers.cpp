// bench_receivers: what rows of vertices lose by their sets and bytes, under lights of every kind,
// what they take, and how long they take in a frame.

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/receivers/exact_light.h"
#include "bench/support/input.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/lights/random_lights.h"
#include "precompute/outputs/receiver_rows.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/triangle.h"
#include "transfer/base/area_norm.h"
#include "transfer/operator/receiver_products.h"

namespace rebounce::bench {
namespace {

constexpr std::uint64_t kSeed = 77;  // not that of the lights that sets are chosen by

// Lights of which less than this part arrives anywhere are left out: those in a slot, or outside.
constexpr double kLeastArriving = 0.1;

struct Options {
  InputOptions input{.patch_counts = {4000}};
  CommonOptions common{.repeats = 11};
  std::vector<double> tolerances{ReceiverRowSettings{}.tolerance};
  std::vector<std::uint32_t> sets{ReceiverRowSettings{}.most_sets};
  ReceiverRowSettings rows{.least_error = 0};
  int lights = 64;  ///< of each kind
};

/// The area of the surface of which each vertex [v] shows a third.
std::vector<double> vertex_areas(const DisplayMesh& mesh) {
  std::vector<double> area(mesh.position.size(), 0.0);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.triangle_patch[t] == kNone) continue;
    for (const std::uint32_t v : mesh.triangle[t]) area[v] += area_of(corners_of(mesh, t));
  }
  return area;
}

/// Those of each tolerance and number of sets.
std::vector<ReceiverRowSettings> row_settings(const Options& options) {
  std::vector<ReceiverRowSettings> all;
  for (const double tolerance : options.tolerances) {
    for (const std::uint32_t sets : options.sets) {
      ReceiverRowSettings& settings = all.emplace_back(options.rows);
      settings.tolerance = tolerance;
      settings.most_sets = sets;
      check_receiver_rows(settings);
    }
  }
  return all;
}

double bytes_of(const ReceiverRows& rows) {
  std::size_t bytes = 0;
  const auto add = [&](const auto& list) { bytes += std::span(list).size_bytes(); };
  add(rows.patch);
  add(rows.set);
  add(rows.group_begin);
  add(rows.entry_set);
  add(rows.scale);
  add(rows.receiver);
  add(rows.value);
  return static_cast<double>(bytes);
}

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

class ReceiverBenchmark {
 public:
  ReceiverBenchmark(const TransferData& data, const Options& options)
      : data_(data),
        options_(options),
        tracer_(make_surface_tracer(data.mesh)),
        area_(vertex_areas(data.mesh)),
        exact_(data, tracer_, options.rows.ray_count) {}

  void run(std::span<const ReceiverRowSettings> settings, Table& table) {
    if (exact_.vertices().empty()) {  // none is small against patches
      return table.add(
          {scene_name(data_), data_.patches.size(), {}, {}, {}, {}, {}, {}, {}, 0, 0, {}, {}, {}});
    }
    for (const ReceiverRowSettings& of_rows : settings) {
      const Made made = make(of_rows);
      for (const LightKind kind : kLightKinds) add_row(made, of_rows, kind, table);
    }
  }

 private:
  struct Made {
    ReceiverRows rows;
    double seconds = 0;
  };

  Made make(const ReceiverRowSettings& settings) const {
    Made made;
    made.seconds = seconds_of([&] {
      made.rows = make_receiver_rows(data_, data_.mesh.triangle_patch,
                                     VertexReceivers(data_, data_.mesh.triangle_patch), tracer_,
                                     settings, 1)
                      .rows;
    });
    return made;
  }

  std::vector<Float3> shown(const ReceiverRows& rows, std::span<const Float3> indirect,
                            std::span<const Float3> radiosity) const {
    std::vector<Float3> light(data_.mesh.position.size());
    reconstruct_at_vertices(data_.mesh, indirect, light);
    ReceiverProducts(rows, data_.patches.area).add(radiosity, light);
    clamp_light(light);
    return light;
  }

  double flux_of(std::span<const Float3> light) const {
    double sum = 0;
    for (std::size_t i = 0; i < light.size(); ++i) {
      const auto& [r, g, b] = light[i];
      sum += static_cast<double>(data_.patches.area[i]) * (r + g + b);
    }
    return sum;
  }

  /// Root mean square over the area, relative to the light of the patches.
  double difference(std::span<const Float3> light, std::span<const Float3> truth,
                    std::span<const Float3> of_patches) const {
    double off = 0, area = 0;
    for (const std::uint32_t v : exact_.vertices()) {
      area += area_[v];
      for (std::size_t c = 0; c < kChannelCount; ++c) {
        const double d = static_cast<double>(light[v][c]) - truth[v][c];
        off += area_[v] * d * d;
      }
    }
    const std::vector<float>& areas = data_.patches.area;
    const double whole = std::accumulate(areas.begin(), areas.end(), 0.0);
    const double usual = area_norm(of_patches, areas) / std::sqrt(whole);
    return usual > 0 ? std::sqrt(off / area) / usual : 0;
  }

  void add_row(const Made& made, const ReceiverRowSettings& settings, LightKind kind,
               Table& table) {
    const auto lights = random_initial_exitances(data_, tracer_, kind, options_.lights, kSeed);
    if (lights.empty()) return;
    const auto radiosities = radiosities_of(*data_.transfer, data_.patches.reflectance, lights);
    std::vector<float> workspace(data_.transfer->workspace_size());
    std::vector<double> error, of_weights;
    std::vector<Float3> indirect(data_.patches.size());
    for (std::size_t k = 0; k < lights.size(); ++k) {
      data_.transfer->apply(lights[k], indirect, workspace);
      if (flux_of(indirect) < kLeastArriving * flux_of(lights[k])) continue;
      const std::vector<Float3> truth = exact_.light(indirect, radiosities[k]);
      error.push_back(difference(shown(made.rows, indirect, radiosities[k]), truth, indirect));
      of_weights.push_back(difference(shown({}, indirect, radiosities[k]), truth, indirect));
    }
    if (error.empty()) return;
    const std::size_t compared = exact_.vertices().size();
    const auto receivers = static_cast<double>(compared);
    const std::size_t with_rows =
        made.rows.receiver.size() -
        static_cast<std::size_t>(std::ranges::count(made.rows.receiver, kNone));
    table.add({scene_name(data_), data_.patches.size(), settings.tolerance, settings.most_sets,
               name(kind), mean(of_weights), std::ranges::max(of_weights), mean(error),
               std::ranges::max(error), compared, with_rows, bytes_of(made.rows) / receivers,
               made.seconds, time_of(made.rows, indirect) / receivers * 1e6});
  }

  double time_of(const ReceiverRows& rows, std::span<const Float3> radiosity) const {
    ReceiverProducts products(rows, data_.patches.area);
    std::vector<Float3> light(data_.mesh.position.size());
    const std::vector<TimedCase> cases{{[&] { products.add(radiosity, light); }}};
    return time_interleaved(cases, {.rounds = options_.common.repeats}).front().median;
  }

  const TransferData& data_;
  const Options& options_;
  RayTracer tracer_;
  std::vector<double> area_;  ///< [v]
  ExactLight exact_;
};

void run(const Options& options) {
  const std::vector<ReceiverRowSettings> settings = row_settings(options);
  Table table({"scene", "patches", "tolerance", "sets", "lights", "weights_mean", "weights_max",
               "rows_mean", "rows_max", "receivers", "with_rows", "bytes_per_receiver", "seconds",
               "microseconds_per_receiver"});
  for_each_input(options.input, [&](const std::shared_ptr<const TransferData>& data) {
    ReceiverBenchmark(*data, options).run(settings, table);
    save("bench_receivers", table, options.common);
  });
  publish("bench_receivers", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::Options options;
  CLI::App app("Errors, bytes and times of rows of vertices.", "bench_receivers");
  rebounce::bench::add_input_options(app, options.input);
  app.add_option("--receiver-tolerance", options.tolerances, "Tolerances, one after the other")
      ->capture_default_str();
  app.add_option("--receiver-sets", options.sets, "Most sets of a group, one after the other")
      ->capture_default_str();
  app.add_option("--receiver-rays", options.rows.ray_count, "Rays of each vertex")
      ->capture_default_str();
  app.add_option("--lights", options.lights, "Lights of each kind")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}

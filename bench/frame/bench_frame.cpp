// bench_frame: the stages of a frame: direct light, the product, outputs.

#include <filesystem>
#include <memory>
#include <utility>

#include "bench/frame/direct_cases.h"
#include "bench/support/input.h"
#include "bench/support/light_changes.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "precompute/import/import_gltf.h"
#include "precompute/lights/random_lights.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/outputs.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/outputs/probe_light.h"
#include "runtime/outputs/surface_light.h"
#include "runtime/outputs/vertex_light.h"

namespace rebounce::bench {
namespace {

constexpr std::array<std::size_t, 3> kLightCounts = {1, 4, 16};
constexpr std::size_t kMovingCount = 2;  // of the lights of a whole frame
constexpr std::size_t kLitCount = 4;     // lights under which the stages after direct light run
constexpr std::size_t kMapSize = 8;      // of an irradiance map

constexpr const char* kBareRays = "16,384 shadow rays alone";

struct FrameOptions {
  bool direct_only = false;
  InputOptions input{.patch_counts = {4000}};
  CommonOptions common{.repeats = 31};
};

MovingLamps random_lamps(const Engine& engine, std::size_t count, std::size_t moving_count) {
  MovingLamps result;
  result.lamps = random_point_lights(engine.data(), *engine.parts().tracer,
                                     static_cast<int>(count + moving_count), 7);
  const auto rest = result.lamps.begin() + static_cast<std::ptrdiff_t>(count);
  result.elsewhere.assign(rest, result.lamps.end());
  result.lamps.erase(rest, result.lamps.end());
  return result;
}

class FrameBenchmark {
 public:
  FrameBenchmark(std::shared_ptr<const TransferData> data, const CommonOptions& options)
      : options_(options),
        engine_(std::move(data)),
        vertices_(engine_.data().mesh.position.size()),
        probes_(engine_.data().probes.size()),
        map_normals_(kMapSize * kMapSize),
        maps_(probes_.size() * map_normals_.size()) {
    write_octahedral_normals(kMapSize, map_normals_);
    const TransferData& scene = engine_.data();
    texels_.resize(scene.lightmap.triangle.size());
    if (!scene.surface_harmonics.empty()) {
      surface_.resize(scene.patches.size());
      surface_at_vertices_.resize(scene.mesh.position.size());
    }
  }

  void run(int threads, Table& table) {
    names_.clear();
    cases_.clear();
    for (const std::size_t count : kLightCounts) add_lights(count);
    engine_.relight(random_lamps(engine_, kLitCount, 0).lamps, {});  // light for what follows
    add("initial exitance", {}, [this] { engine_.parts().compute_initial_exitance(); });
    add("product", {}, [this] { engine_.parts().apply_transfer(); });
    add("radiosity", {}, [this] { engine_.parts().compute_radiosity(); });
    add_outputs();
    const std::vector<Timing> timings = time_interleaved(cases_, {.rounds = options_.repeats});
    for (std::size_t k = 0; k < cases_.size(); ++k) {
      table.add({scene_name(engine_.data()),
                 engine_.data().patches.size(),
                 threads,
                 names_[k].first,
                 names_[k].second,
                 timings[k].median * 1e6,
                 timings[k].spread,
                 {},
                 {},
                 {}});
    }
  }

 private:
  void add(const std::string& stage, const Table::Cell& lights, const std::function<void()>& work) {
    names_.emplace_back(stage, lights);
    cases_.push_back({.work = work});
  }

  void add_lights(std::size_t count) {
    const auto still = std::make_shared<Engine>(engine_);
    add("direct, none moved", count, [still, lamps = random_lamps(engine_, count, 0).lamps] {
      still->parts().compute_direct(lamps, {});
    });
    if (count < kMovingCount) return;
    // The whole frame keeps its own engine: what does not move is known from its last frame.
    const auto some = std::make_shared<MovingLamps>(random_lamps(engine_, count, kMovingCount));
    const auto own = std::make_shared<Engine>(engine_);
    add("frame, two moved", count, [this, own, some] {
      own->relight(some->next(), {});
      vertex_irradiance(*own, vertices_);
    });
  }

  /// Those that the file has.
  void add_outputs() {
    add("vertices", {}, [this] { to_vertices(); });
    if (!texels_.empty()) add("lightmap", {}, [this] { to_texels(); });
    if (!surface_.empty()) add("bent normals", {}, [this] { to_surface(); });
    if (probes_.empty()) return;
    add("probes", {}, [this] { to_probes(); });
    add("irradiance maps of probes", {}, [this] { to_maps(); });
    if (engine_.data().probes.grid[0] > 0) {
      add("one point in the air", {}, [this] { to_point_in_air(); });
    }
  }

  void to_vertices() { vertex_irradiance(engine_, vertices_); }
  void to_texels() { lightmap_irradiance(engine_, texels_); }
  void to_surface() {
    apply_surface_harmonics(engine_.data().surface_harmonics, engine_.radiosity(), {}, surface_);
    reconstruct_at_vertices(engine_.data().mesh, surface_, surface_at_vertices_);
  }
  void to_probes() { apply_probes(engine_.data().probes, engine_.radiosity(), {}, probes_); }
  void to_maps() {
    irradiance_at_probes(engine_.data().probes, engine_.radiosity(), {}, map_normals_, maps_);
  }
  void to_point_in_air() {
    const LightProbes& probes = engine_.data().probes;
    // In the middle of the grid, between eight probes.
    const Float3 &a = probes.position.front(), &b = probes.position.back();
    const Float3 middle = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
    air_ = gather_probe_light(probes, engine_.radiosity(), {}, middle);
  }

  const CommonOptions& options_;
  Engine engine_;
  std::vector<Float3> vertices_;
  std::vector<ProbeLight> probes_;
  std::vector<Float3> map_normals_, maps_;
  ProbeLight air_{};
  std::vector<Float3> texels_;
  std::vector<SurfaceLight> surface_, surface_at_vertices_;
  std::vector<std::pair<std::string, Table::Cell>> names_;
  std::vector<TimedCase> cases_;
};

/// Direct light alone. It needs no operator.
void run_direct(const TransferData& data, const CommonOptions& options, int threads, Table& table) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  DirectCases direct(data, tracer);
  std::vector<TimedCase> cases = {bare_rays(data, tracer)};
  direct.add_to(cases);
  const std::vector<Timing> timings = time_interleaved(cases, {.rounds = options.repeats});
  const std::string name = scene_name(data);
  const auto microseconds = [&](std::size_t k) { return timings[k].median * 1e6; };
  table.add({name,
             data.patches.size(),
             threads,
             kBareRays,
             {},
             microseconds(0),
             timings[0].spread,
             {},
             {},
             {}});
  for (std::size_t k = 0; k < direct.rows().size(); ++k) {
    const DirectCases::Row& row = direct.rows()[k];
    table.add({name, data.patches.size(), threads, row.name, row.lights,
               microseconds(1 + 2 * k) / DirectCases::kRuns, timings[1 + 2 * k].spread,
               microseconds(2 + 2 * k) / DirectCases::kRuns, row.errors.mean, row.errors.largest});
  }
}

/// The patches of a scene, without an operator.
TransferData patches_of(const std::string& scene, std::size_t patch_count) {
  PatchModel model = make_patch_model(import_gltf(scene), {.patch_count = patch_count});
  TransferData data;
  data.record.scene_name = std::filesystem::path(scene).filename().string();
  data.mesh = std::move(model.mesh);
  data.patches = std::move(model.patches);
  data.patches.sky_visibility.assign(data.patches.size(), 0);
  return data;
}

void run(const FrameOptions& options) {
  Table table({"scene", "patches", "threads", "stage", "lights", "microseconds", "spread",
               "all traced", "error", "largest error"});
  if (options.direct_only) {
    require_scenes(options.input);
    for (const std::string& scene : options.input.inputs) {
      for (const std::size_t count : options.input.patch_counts) {
        const TransferData data = patches_of(scene, count);
        run_at_thread_counts(
            options.common, [&](int threads) { run_direct(data, options.common, threads, table); });
        save("bench_frame", table, options.common);
      }
    }
    return publish("bench_frame", table, options.common);
  }
  for_each_input(options.input, [&](const std::shared_ptr<const TransferData>& data) {
    FrameBenchmark benchmark(data, options.common);
    run_at_thread_counts(options.common, [&](int threads) {
      run_direct(*data, options.common, threads, table);
      benchmark.run(threads, table);
    });
    save("bench_frame", table, options.common);
  });
  publish("bench_frame", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::FrameOptions options;
  CLI::App app("Times the stages of a frame, with 1, 4 and 16 lights.", "bench_frame");
  rebounce::bench::add_input_options(app, options.input);
  app.add_flag("--direct-only", options.direct_only,
               "Direct light alone, of scenes; no operator is built");
  app.add_option("--probes", options.input.settings.probes.spacing,
                 "Light probes this many metres apart, of scenes that are built")
      ->check(CLI::PositiveNumber);
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}

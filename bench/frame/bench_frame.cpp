// bench_frame: the stages of a frame: direct light, the product, outputs.

#include <algorithm>
#include <memory>
#include <utility>

#include "bench/support/input.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "precompute/lights/random_lights.h"
#include "rebounce/outputs.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/outputs/probe_light.h"
#include "runtime/outputs/surface_light.h"
#include "runtime/outputs/texel_light.h"
#include "runtime/outputs/vertex_light.h"

namespace rebounce::bench {
namespace {

constexpr std::array<std::size_t, 3> kLightCounts = {1, 4, 16};
constexpr std::size_t kMovingCount = 2;  // of the lights of a whole frame
constexpr std::size_t kBareRays = 16384;
constexpr std::size_t kMapSize = 8;  // of an irradiance map

struct FrameOptions {
  InputOptions input{.patch_counts = {4000}};
  CommonOptions common{.repeats = 31};
};

/// Lights in two places each, so that every run finds them moved.
class MovingLights {
 public:
  MovingLights(const Engine& engine, std::size_t count, std::size_t moving)
      : moving_(std::min(count, moving)) {
    const int twice = static_cast<int>(2 * count);
    const std::vector<Light> all =
        random_point_lights(engine.data(), *engine.parts().tracer, twice, 7);
    lights_.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
    elsewhere_.assign(all.begin() + static_cast<std::ptrdiff_t>(count), all.end());
  }

  void turn_into(LightType type) {
    for (std::vector<Light>* lights : {&lights_, &elsewhere_}) {
      for (Light& light : *lights) {
        light.type = type;
        light.radius = 0.05F;
        light.outer_cone_angle = 0.6F;
      }
    }
  }

  std::span<const Light> next() {
    for (std::size_t k = 0; k < moving_; ++k)
      std::swap(lights_[k].position, elsewhere_[k].position);
    return lights_;
  }

 private:
  std::size_t moving_;
  std::vector<Light> lights_, elsewhere_;
};

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
    add_bare_rays();
    add("initial exitance", {}, [this] { engine_.parts().compute_initial_exitance(); });
    add("product", {}, [this] { engine_.parts().apply_transfer(); });
    add("radiosity", {}, [this] { engine_.parts().compute_radiosity(); });
    add_outputs();
    const std::vector<Timing> timings = time_interleaved(cases_, {.rounds = options_.repeats});
    for (std::size_t k = 0; k < cases_.size(); ++k) {
      table.add({scene_name(engine_.data()), engine_.data().patches.size(), threads,
                 names_[k].first, names_[k].second, timings[k].median * 1e6, timings[k].spread});
    }
  }

 private:
  void add(const std::string& stage, const Table::Cell& lights, const std::function<void()>& work) {
    names_.emplace_back(stage, lights);
    cases_.push_back({.work = work});
  }

  void add_lights(std::size_t count) {
    const auto all = std::make_shared<MovingLights>(engine_, count, count);
    add("direct, all moved", count,
        [this, all] { engine_.parts().compute_direct(all->next(), {}); });
    const auto none = std::make_shared<MovingLights>(engine_, count, 0);
    const auto still = std::make_shared<Engine>(engine_);
    add("direct, none moved", count,
        [still, none] { still->parts().compute_direct(none->next(), {}); });
    for (const auto& [name, type] : {std::pair("direct, spots moved", LightType::kSpot),
                                     std::pair("direct, spheres moved", LightType::kSphere)}) {
      const auto lights = std::make_shared<MovingLights>(engine_, count, count);
      lights->turn_into(type);
      add(name, count, [this, lights] { engine_.parts().compute_direct(lights->next(), {}); });
    }
    // The whole frame keeps its own engine: what does not move is known from its last frame.
    const auto some = std::make_shared<MovingLights>(engine_, count, kMovingCount);
    const auto own = std::make_shared<Engine>(engine_);
    add("frame, two moved", count, [this, own, some] {
      own->relight(some->next(), {});
      reconstruct_at_vertices(own->data().mesh, own->indirect_irradiance(), vertices_);
    });
  }

  /// What the ray tracer alone takes for some of the rays of a frame: from patches to one lamp.
  void add_bare_rays() {
    const TransferData& scene = engine_.data();
    const RayTracer& tracer = *engine_.parts().tracer;
    const Float3 lamp = random_point_lights(scene, tracer, 1, 7).front().position;
    const auto rays = std::make_shared<std::vector<Ray>>(kBareRays);
    for (std::size_t k = 0; k < kBareRays; ++k) {
      const std::size_t patch = k * scene.patches.size() / kBareRays;
      Ray& ray = (*rays)[k];
      ray.origin = tracer.offset_point(scene.patches.centroid[patch], scene.patches.normal[patch]);
      ray.t_near = 0;
      for (int c = 0; c < 3; ++c) ray.direction[c] = lamp[c] - ray.origin[c];
    }
    add("16,384 shadow rays alone", {}, [&tracer, rays] {
      for (Ray& ray : *rays) ray.t_far = 1;
      tracer.occluded(*rays);
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

  void to_vertices() {
    reconstruct_at_vertices(engine_.data().mesh, engine_.indirect_irradiance(), vertices_);
  }
  void to_texels() {
    interpolate_at_texels(engine_.data().lightmap, engine_.data().mesh, vertices_, texels_);
  }
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

void run(const FrameOptions& options) {
  Table table({"scene", "patches", "threads", "stage", "lights", "microseconds", "spread"});
  for_each_input(options.input, [&](const std::shared_ptr<const TransferData>& data) {
    FrameBenchmark benchmark(data, options.common);
    run_at_thread_counts(options.common, [&](int threads) { benchmark.run(threads, table); });
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
  app.add_option("--probes", options.input.settings.probes.spacing,
                 "Light probes this many metres apart, of scenes that are built")
      ->check(CLI::PositiveNumber);
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}

// bench_gpu: the stages of a frame on the graphics card, beside those of the processor.

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bench/support/input.h"
#include "bench/support/light_changes.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "rebounce/error.h"
#include "rebounce/outputs.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/gpu/gl_resources.h"
#include "runtime/gpu/gpu_operator.h"
#include "tests/gl/gl_context.h"
#include "tests/gl/shadow_maps.h"
#include "transfer/base/area_norm.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::bench {
namespace {

constexpr int kMapSide = 1024;                    // texels of a shadow map
constexpr std::size_t kCopyBytes = 128ULL << 20;  // more than caches of cards hold
constexpr double kFirstSeconds = 1.5;             // not counted: the driver compiles, clocks rise

struct GpuOptions {
  InputOptions input{.patch_counts = {4096}};
  int lamps = 16;
  CommonOptions common{.repeats = 51};
};

std::string card_name() {
  const auto* const name = glGetString(GL_RENDERER);
  return name == nullptr ? "unknown" : reinterpret_cast<const char*>(name);
}

/// Time on the card, by the engine's own time stamps.
class CardTimer {
 public:
  explicit CardTimer(const std::shared_ptr<const GlFunctions>& gl) : timer_(gl, 1) {
    timer_.switch_on(true);
  }

  void begin() { timer_.begin(); }
  void end() { timer_.mark("all"); }

  /// Between the last two; waits for the card.
  double seconds() const {
    std::vector<GpuStageTime> times;
    timer_.add_to(times);
    return 1e-6 * times.front().microseconds;
  }

 private:
  StageTimer timer_;
};

/// Copies a buffer that no cache holds: a frame after it finds its tables in the card's memory, and
/// its time tells the bandwidth of that memory.
class MemoryCopy {
 public:
  explicit MemoryCopy(const std::shared_ptr<const GlFunctions>& gl)
      : program_(gl, "copy", kCopyShader),
        from_(gl, kCopyBytes, nullptr),
        to_(gl, kCopyBytes, nullptr),
        timer_(gl) {}

  void run() {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, from_.name());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, to_.name());
    timer_.begin();
    program_.run(static_cast<std::uint32_t>(kCopyBytes / kBytesOfGroup));
    timer_.end();
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  }

  /// Bytes read and written by the last run in a second; waits for the card.
  double bytes_per_second() const { return 2 * kCopyBytes / timer_.seconds(); }

 private:
  static constexpr std::size_t kBytesOfGroup = 256 * 16;
  static constexpr const char* kCopyShader = R"glsl(#version 430
layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer From { uvec4 from[]; };
layout(std430, binding = 1) writeonly buffer To { uvec4 to[]; };
void main() {
  uint k = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 256u + gl_LocalInvocationID.x;
  if (k < to.length()) to[k] = from[k] + 1u;
}
)glsl";

  ComputeProgram program_;
  StorageBuffer from_, to_;
  CardTimer timer_;
};

/// Point lights and spots in turns, with their shadow maps.
std::vector<GpuLamp> lamps_with_maps(const TransferData& data, const RayTracer& tracer, int count,
                                     test::ShadowMaps& maps) {
  std::vector<Light> places = lamps_in_the_open(data, tracer, 2 * count, 7);
  places.resize(std::min(places.size(), static_cast<std::size_t>(count)));
  const Float3& target = data.patches.centroid[data.patches.size() / 2];
  std::vector<GpuLamp> lamps;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const bool is_spot = k % 2 == 1;
    const LightType type = is_spot ? LightType::kSpot : LightType::kPoint;
    const Light lamp = lamp_of_type(type, places[k], target, double{maps.diagonal()});
    lamps.push_back(is_spot ? maps.plane(lamp, kMapSide, false) : maps.cube(lamp, kMapSide));
  }
  return lamps;
}

template <typename T>
double bytes_of(const std::vector<T>& list) {
  return static_cast<double>(list.size() * sizeof(T));
}

/// The times of one stage over all frames.
struct StageSamples {
  std::string name;
  std::vector<double> seconds;
};

class GpuBenchmark {
 public:
  GpuBenchmark(const std::shared_ptr<const TransferData>& data, const GpuOptions& options)
      : options_(options),
        engine_(data),
        gpu_(data, eglGetProcAddress),
        maps_(*data),
        lamps_(lamps_with_maps(*data, *engine_.parts().tracer, options.lamps, maps_)),
        direct_(data->patches.size()),
        indirect_(data->patches.size()),
        radiosity_(data->patches.size()),
        vertices_(data->mesh.position.size()),
        gl_(std::make_shared<const GlFunctions>(eglGetProcAddress)),
        copy_(gl_),
        timer_(gl_),
        tables_(make_gpu_operator(
            dynamic_cast<const HierarchicalOperator&>(*data->transfer).storage())) {
    for (const GpuLamp& lamp : lamps_) lights_.push_back(lamp.light);
  }

  void run(Table& table) {
    for (const bool by_stages : {true, false}) {
      gpu_.measure_stages(by_stages);
      for (double seconds = 0; seconds < kFirstSeconds;)
        seconds += seconds_of([&] { run_frame(false); });
      for (int k = 0; k < options_.common.repeats; ++k) run_frame(true);
    }
    time_processor();
    double of_product = 0;
    for (const StageSamples& stage : stages_) {
      const Timing timing = summarise(stage.seconds);
      if (is_of_product(stage.name)) of_product += timing.median;
      add_row(table, stage.name, timing.median, timing.spread, bytes_of_stage(stage.name));
    }
    add_row(table, kProduct, of_product, {}, bytes_of_product());
    for (const auto& [name, samples] : {std::pair{kFrame, &frames_}, std::pair{kCalls, &calls_}}) {
      const Timing timing = summarise(*samples);
      add_row(table, name, timing.median, timing.spread, 0);
    }
  }

 private:
  static constexpr const char* kProduct = "product";
  static constexpr const char* kFrame = "frame without shadow maps";
  static constexpr const char* kCalls = "calls of a frame";

  static bool is_of_product(const std::string& stage) {
    return stage.starts_with("project ") || stage == "couplings" || stage.starts_with("expand ");
  }

  /// One frame after a copy. Its stages are measured, or else its whole: time stamps between stages
  /// keep the card from beginning one before the last is out of the way.
  void run_frame(bool is_counted) {
    copy_.run();
    glFinish();
    timer_.begin();
    const double calls = seconds_of([&] {
      gpu_.light_patches(lamps_, direct_.name());
      gpu_.relight({.direct_irradiance = direct_.name(),
                    .indirect_irradiance = indirect_.name(),
                    .radiosity = radiosity_.name(),
                    .vertex_irradiance = vertices_.name()});
    });
    timer_.end();
    const std::vector<GpuStageTime> times = gpu_.stage_times();
    if (!is_counted) return;
    copies_.push_back(copy_.bytes_per_second());
    if (times.empty()) {
      frames_.push_back(timer_.seconds());
      calls_.push_back(calls);
    }
    stages_.resize(std::max(stages_.size(), times.size()));
    for (std::size_t k = 0; k < times.size(); ++k) {
      stages_[k].name = times[k].name;
      stages_[k].seconds.push_back(1e-6 * times[k].microseconds);
    }
  }

  /// The same frame by the processor, and how far the light of the card is from it, of the same
  /// direct light.
  void time_processor() {
    std::vector<Float3> at_vertices(engine_.data().mesh.position.size());
    std::vector<Light> elsewhere = lights_;
    for (Light& light : elsewhere) light.position[1] += 1e-3F * maps_.diagonal();
    bool is_moved = false;
    const std::vector<TimedCase> cases = {
        {.work =
             [&] {
               is_moved = !is_moved;
               engine_.parts().compute_direct(is_moved ? elsewhere : lights_, {});
             }},
        {.work = [&] { engine_.parts().compute_initial_exitance(); }},
        {.work = [&] { engine_.parts().apply_transfer(); }},
        {.work = [&] { engine_.parts().compute_radiosity(); }},
        {.work = [&] { vertex_irradiance(engine_, at_vertices); }},
    };
    processor_ = time_interleaved(cases, {.rounds = options_.common.repeats});
    const std::vector<float>& area = engine_.data().patches.area;
    engine_.relight(lights_, {});
    direct_difference_ = relative_difference(direct_.read(), engine_.direct_irradiance(), area);
    engine_.relight(direct_.read());
    difference_ = relative_difference(indirect_.read(), engine_.indirect_irradiance(), area);
  }

  /// Microseconds that the processor takes for a stage of the card; nothing where it has no such
  /// stage.
  Table::Cell of_processor(const std::string& stage) const {
    const auto microseconds = [&](std::size_t k) { return processor_[k].median * 1e6; };
    if (stage == "direct light") return microseconds(0);
    if (stage == "initial exitance") return microseconds(1);
    if (stage == kProduct) return microseconds(2);
    if (stage == "radiosity") return microseconds(3);
    if (stage == "vertices") return microseconds(4);
    if (stage != kFrame) return {};
    double sum = 0;
    for (std::size_t k = 0; k < processor_.size(); ++k) sum += microseconds(k);
    return sum;
  }

  Table::Cell difference(const std::string& stage) const {
    if (stage == "direct light") return direct_difference_;
    if (stage == kProduct) return difference_;
    return {};
  }

  /// What a stage reads of the operator, each table once; 0 if nothing.
  double bytes_of_stage(const std::string& stage) const {
    if (stage == "couplings") {
      return bytes_of(tables_.couplings) + bytes_of(tables_.outputs) + bytes_of(tables_.inputs) +
             bytes_of(tables_.sides);
    }
    return 0;
  }

  double bytes_of_product() const {
    return 2 * bytes_of(tables_.bases) + bytes_of(tables_.projections) +
           bytes_of(tables_.strip_entries) + bytes_of_stage("couplings");
  }

  void add_row(Table& table, const std::string& stage, double seconds, const Table::Cell& spread,
               double bytes) const {
    const double of_memory = summarise(copies_).median;
    Table::Cell rate, share;
    if (bytes > 0) {
      rate = bytes / seconds * 1e-9;
      share = bytes / seconds / of_memory;
    }
    table.add({scene_name(engine_.data()), engine_.data().patches.size(), lamps_.size(),
               card_name(), stage, seconds * 1e6, spread, rate, share, of_processor(stage),
               difference(stage)});
  }

  const GpuOptions& options_;
  Engine engine_;
  GpuEngine gpu_;
  test::ShadowMaps maps_;
  std::vector<GpuLamp> lamps_;
  std::vector<Light> lights_;
  test::LightBuffer direct_, indirect_, radiosity_, vertices_;
  std::shared_ptr<const GlFunctions> gl_;
  MemoryCopy copy_;
  CardTimer timer_;
  GpuOperator tables_;
  std::vector<StageSamples> stages_;
  std::vector<double> frames_, calls_;
  std::vector<double> copies_;  // bytes per second
  std::vector<Timing> processor_;
  double direct_difference_ = 0, difference_ = 0;
};

void run(const GpuOptions& options) {
  const test::GlContext context;
  if (!context.is_current()) {
    throw Error(
        "there is no OpenGL 4.3 without a window here; install a driver of the card, or "
        "Mesa's (libegl-mesa0, libgl1-mesa-dri)");
  }
  Table table({"scene", "patches", "lamps", "card", "stage", "microseconds", "spread", "GB/s",
               "of memory", "processor", "difference"});
  for_each_input(options.input, [&](const std::shared_ptr<const TransferData>& data) {
    GpuBenchmark(data, options).run(table);
    save("bench_gpu", table, options.common);
  });
  publish("bench_gpu", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::GpuOptions options;
  CLI::App app("Times the stages of a frame on the graphics card, beside the processor's.",
               "bench_gpu");
  rebounce::bench::add_input_options(app, options.input);
  app.add_option("--lamps", options.lamps, "Point lights and spots, in turns")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  rebounce::bench::add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}

// Many light states of one scene on many threads, and frames on the threads of a caller. Runs clean
// under the thread sanitizer (preset tsan), which knows std::thread but not OpenMP.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "rebounce/engine.h"
#include "rebounce/outputs.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scene_data.h"
#include "tests/support/thread_pool.h"

namespace rebounce::test_engine_threads {
namespace {

constexpr int kFrames = 6;

/// The calling thread alone.
constexpr Scheduler kOneThread = {
    [](void*, std::uint32_t count, Scheduler::Task task, void* context) {
      for (std::uint32_t k = 0; k < count; ++k) task(context, k);
    }};

/// Probes, a texel for each triangle and surface harmonics, that see all patches alike.
void add_outputs(TransferData& data) {
  constexpr std::size_t kProbes = 9;
  LightProbes& probes = data.probes;
  probes.position.assign(kProbes, {0, 0.5F, 0});
  probes.valid.assign(kProbes, 1);
  probes.sky.assign(kProbes, Harmonics{});
  probes.patch_count = data.patches.size();
  probes.entry_begin = {0};
  for (std::size_t p = 0; p < kProbes; ++p) {
    for (std::uint32_t i = 0; i < data.patches.size(); ++i) {
      probes.entry_patch.push_back(i);
      probes.entry_weight.push_back(Harmonics{0.1F, 0.01F * static_cast<float>((i + p) % 7)});
    }
    probes.entry_begin.push_back(static_cast<std::uint32_t>(probes.entry_patch.size()));
  }
  Lightmap& map = data.lightmap;
  map.width = static_cast<std::uint32_t>(data.mesh.triangle.size());
  map.height = 1;
  map.weight.assign(map.width, Float2{0.25F, 0.5F});
  SurfaceHarmonics& harmonics = data.surface_harmonics;
  harmonics.sky.assign(data.patches.size(), LinearHarmonics{1, 1});
  harmonics.entry_begin = {0};
  for (std::uint32_t i = 0; i < data.patches.size(); ++i) {
    map.triangle.push_back(i);
    harmonics.entry_patch.push_back(static_cast<std::uint32_t>(data.patches.size() - 1 - i));
    harmonics.entry_weight.push_back(LinearHarmonics{0.3F, 0.1F});
    harmonics.entry_begin.push_back(i + 1);
  }
}

/// Two squares of steps² x 2 patches with a smaller one between them.
std::shared_ptr<const TransferData> room(int steps) {
  auto data = std::make_shared<TransferData>();
  test::add_square(*data, 1, 0, steps, true, {0.5F, 0.4F, 0.3F});
  test::add_square(*data, 1, 2, steps, false, {0.2F, 0.7F, 0.9F});
  test::add_square(*data, 0.3F, 1, 2, true, {0.8F, 0.8F, 0.8F});
  test::add_even_exchange(*data);
  DisplayMesh& mesh = data->mesh;
  mesh.weight_begin.push_back(0);
  for (std::uint32_t v = 0; v < mesh.position.size(); ++v) {
    mesh.weight_patch.push_back(v / 3);
    mesh.weight.push_back(1);
    mesh.weight_begin.push_back(v + 1);
  }
  add_outputs(*data);
  return data;
}

/// The lights of one state in one frame: some move, one has a surface, one is dimmed.
std::vector<Light> lights_of(int state, int frame) {
  std::vector<Light> lights(4);
  const auto s = static_cast<float>(state), f = static_cast<float>(frame);
  lights[0].position = {-0.7F + 0.15F * s, 1.4F, 0.05F * f};
  lights[1].type = LightType::kSpot;
  lights[1].position = {0.5F, 1.8F, 0.1F * s - 0.4F};
  lights[2].type = LightType::kSphere;
  lights[2].position = {0.1F * f - 0.6F, 1.5F, -0.3F};
  lights[2].radius = 0.1F;
  lights[3].position = {0, 1.9F, 0};
  lights[3].intensity = 1 / (1 + f);
  return lights;
}

struct Outputs {
  std::vector<Float3> radiosity, vertices, texels, at_probes;
  std::vector<ProbeLight> probes;
  std::vector<QuadraticProbeLight> quadratic_probes;
  std::vector<SurfaceLight> vertex_light;
  bool operator==(const Outputs&) const = default;
};

constexpr std::array<Float3, 2> kNormals = {{{0, 1, 0}, {1, 0, 0}}};

void frame(Engine& engine, std::span<const Light> lights, Outputs& outputs) {
  engine.relight(lights, {{1, 1, 1}, 2});
  vertex_irradiance(engine, outputs.vertices);
  lightmap_irradiance(engine, outputs.texels);
  probe_light(engine, outputs.probes);
  probe_light(engine, outputs.quadratic_probes);
  probe_irradiance(engine, kNormals, outputs.at_probes);
  vertex_light(engine, outputs.vertex_light);
}

Outputs room_for(const Engine& engine) {
  const std::size_t vertices = engine.data().mesh.position.size();
  const std::size_t probes = engine.data().probes.size();
  Outputs outputs;
  outputs.vertices.resize(vertices);
  outputs.texels.resize(engine.data().lightmap.triangle.size());
  outputs.at_probes.resize(probes * kNormals.size());
  outputs.probes.resize(probes);
  outputs.quadratic_probes.resize(probes);
  outputs.vertex_light.resize(vertices);
  return outputs;
}

/// The last frame of a state.
Outputs play(Engine engine, int state) {
  Outputs outputs = room_for(engine);
  for (int k = 0; k < kFrames; ++k) frame(engine, lights_of(state, k), outputs);
  outputs.radiosity.assign(engine.radiosity().begin(), engine.radiosity().end());
  return outputs;
}

/// The last frames of `count` states, each on a thread of its own at the same time.
std::vector<Outputs> play_together(const Engine& engine, int count) {
  std::vector<Outputs> together(static_cast<std::size_t>(count));
  std::atomic<int> ready = 0;
  std::vector<std::thread> threads;
  for (int state = 0; state < count; ++state) {
    threads.emplace_back([&, state] {
      ++ready;
      while (ready < count) std::this_thread::yield();  // all at once
      together[static_cast<std::size_t>(state)] = play(engine, state);
    });
  }
  for (std::thread& thread : threads) thread.join();
  return together;
}

TEST(EngineThreads, EightLightStatesOverOneTransfer) {
  const Engine engine(room(8), {.scheduler = kOneThread});
  const std::vector<Outputs> together = play_together(engine, 8);
  for (int state = 0; state < 8; ++state) {
    const Outputs alone = play(engine, state);
    EXPECT_EQ(alone, together[static_cast<std::size_t>(state)]);
    EXPECT_EQ(state == 0, alone == together[0]);
  }
}

TEST(EngineThreads, AFrameOnTheThreadsOfACallerHasTheSameBits) {
  const auto data = room(24);
  test::ThreadPool pool(3);
  const Outputs usual = play(Engine(data), 1);
  EXPECT_EQ(usual, play(Engine(data, {.scheduler = kOneThread}), 1));
  EXPECT_EQ(usual, play(Engine(data, {.scheduler = pool.scheduler()}), 1));
  // Of a frame: direct light, the product, and eight loops of outputs.
  EXPECT_GE(pool.loop_count(), 10 * kFrames);
}

TEST(EngineThreads, EnginesShareTheThreadsOfACaller) {
  const auto data = room(24);
  test::ThreadPool pool(2);
  const std::vector<Outputs> together =
      play_together(Engine(data, {.scheduler = pool.scheduler()}), 2);
  const Engine usual(data);
  EXPECT_EQ(play(usual, 0), together[0]);
  EXPECT_EQ(play(usual, 1), together[1]);
}

TEST(EngineThreads, AFrameWithAllOutputsDoesNotAllocate) {
  test::ThreadPool pool(3);
  for (const Scheduler& scheduler : {Scheduler{}, pool.scheduler()}) {
    Engine engine(room(24), {.scheduler = scheduler});
    Outputs outputs = room_for(engine);
    const std::vector<Light> first = lights_of(0, 0), second = lights_of(1, 3);
    frame(engine, first, outputs);  // threads and their buffers are made once
    const int count = test::count_allocations([&] { frame(engine, second, outputs); });
    EXPECT_EQ(count, 0);
  }
}

/// Another thread that relights an engine within its frame, and what it is told.
struct Meddler {
  Engine* engine = nullptr;
  std::string message;
};

TEST(EngineThreads, AFrameWithinAFrameIsRefused) {
  Meddler meddler;
  const Scheduler scheduler = {
      [](void* user, std::uint32_t count, Scheduler::Task task, void* context) {
        Meddler& other = *static_cast<Meddler*>(user);
        std::thread([&] {
          if (other.engine == nullptr) return;
          other.message = test::error_of([&] { other.engine->relight(lights_of(1, 1), {}); });
        }).join();
        kOneThread.parallel_for(nullptr, count, task, context);
      },
      &meddler};
  Engine engine(room(6), {.scheduler = scheduler});
  engine.relight(lights_of(0, 0), {});
  const std::vector<Float3> alone(engine.radiosity().begin(), engine.radiosity().end());
  engine.relight(lights_of(1, 1), {});
  meddler.engine = &engine;
  engine.relight(lights_of(0, 0), {});
  EXPECT_NE(meddler.message.find("two threads"), std::string::npos);
  EXPECT_TRUE(std::ranges::equal(alone, engine.radiosity()));
  // A copy is another engine.
  Engine copy(engine);
  meddler.engine = nullptr;
  copy.relight(lights_of(0, 0), {});
  EXPECT_TRUE(std::ranges::equal(alone, copy.radiosity()));
}

}  // namespace
}  // namespace rebounce::test_engine_threads

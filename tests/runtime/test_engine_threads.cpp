// Many light states of one scene on many threads. Runs clean under the thread sanitizer (preset
// tsan): each thread keeps its loops to itself, as GCC's OpenMP runtime is not instrumented and its
// barriers would look like races.

#include <gtest/gtest.h>
#include <omp.h>

#include <atomic>
#include <thread>

#include "allocation_counter.h"
#include "rebounce/runtime/engine.h"
#include "rebounce/runtime/probe_light.h"
#include "rebounce/runtime/vertex_light.h"
#include "test_scene_data.h"

namespace rebounce {
namespace {

constexpr int kThreads = 8, kFrames = 12;

std::shared_ptr<const TransferData> room() {
  auto data = std::make_shared<TransferData>();
  test::add_square(*data, 1, 0, 8, true, {0.5F, 0.4F, 0.3F});
  test::add_square(*data, 1, 2, 8, false, {0.2F, 0.7F, 0.9F});
  test::add_square(*data, 0.3F, 1, 2, true, {0.8F, 0.8F, 0.8F});
  test::add_even_exchange(*data);
  DisplayMesh& mesh = data->mesh;
  mesh.weight_begin.push_back(0);
  for (std::uint32_t v = 0; v < mesh.position.size(); ++v) {
    mesh.weight_patch.push_back(v / 3);
    mesh.weight.push_back(1);
    mesh.weight_begin.push_back(v + 1);
  }
  LightProbes& probes = data->probes;
  probes.position = {{0, 0.5F, 0}};
  probes.valid = {1};
  probes.sky = {Harmonics{}};
  probes.patch_count = data->patches.size();
  for (std::uint32_t i = 0; i < data->patches.size(); ++i) {
    probes.entry_patch.push_back(i);
    probes.entry_weight.push_back(Harmonics{0.1F, 0.01F * static_cast<float>(i % 7)});
  }
  probes.entry_begin = {0, static_cast<std::uint32_t>(data->patches.size())};
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
  std::vector<Float3> radiosity, vertices;
  std::vector<ProbeLight> probes;
  bool operator==(const Outputs&) const = default;
};

void frame(Engine& engine, std::span<const Light> lights, Outputs& outputs) {
  engine.relight(lights, {});
  reconstruct_at_vertices(engine.data().mesh, engine.indirect_irradiance(), outputs.vertices);
  apply_probes(engine.data().probes, engine.radiosity(), {}, outputs.probes);
}

Outputs room_for(const Engine& engine) {
  return {{},
          std::vector<Float3>(engine.data().mesh.position.size()),
          std::vector<ProbeLight>(engine.data().probes.size())};
}

/// The last frame of a state.
Outputs play(Engine engine, int state) {
  Outputs outputs = room_for(engine);
  for (int k = 0; k < kFrames; ++k) frame(engine, lights_of(state, k), outputs);
  outputs.radiosity.assign(engine.radiosity().begin(), engine.radiosity().end());
  return outputs;
}

TEST(EngineThreads, EightLightStatesOverOneTransfer) {
  omp_set_num_threads(1);
  const Engine engine(room());
  std::vector<Outputs> alone;
  for (int state = 0; state < kThreads; ++state) alone.push_back(play(engine, state));

  std::vector<Outputs> together(kThreads);
  std::atomic<int> ready = 0;
  std::vector<std::thread> threads;
  for (int state = 0; state < kThreads; ++state) {
    threads.emplace_back([&, state] {
      omp_set_num_threads(1);
      ++ready;
      while (ready < kThreads) std::this_thread::yield();  // all at once
      together[static_cast<std::size_t>(state)] = play(engine, state);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t state = 0; state < alone.size(); ++state) {
    EXPECT_EQ(alone[state], together[state]);
    EXPECT_EQ(state == 0, alone[state] == alone[0]);
  }
}

TEST(EngineThreads, AFrameWithAllOutputsDoesNotAllocate) {
  Engine engine(room());
  Outputs outputs = room_for(engine);
  const std::vector<Light> first = lights_of(0, 0), second = lights_of(1, 3);
  frame(engine, first, outputs);  // threads and their buffers are made once
  const int count = test::count_allocations([&] { frame(engine, second, outputs); });
  EXPECT_EQ(count, 0);
}

}  // namespace
}  // namespace rebounce

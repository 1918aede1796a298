#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rebounce.h"
#include "rebounce/engine.h"
#include "runtime/frame/c_handles.h"
#include "runtime/gpu/gl_resources.h"
#include "tests/gl/shadow_maps.h"
#include "tests/runtime/gpu/gpu_engine_test.h"
#include "tests/runtime/gpu/gpu_frame.h"
#include "tests/support/expect_error.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/random_light.h"

// Drivers keep what they allocate: the leak checker of a build with sanitizers looks away.
extern "C" const char* __lsan_default_options() {  // NOLINT: the checker's own name
  return "detect_leaks=0";
}

namespace rebounce::test_gpu_engine {
namespace {

using test::a_lamp_of_each_kind;
using test::GpuEngineTest;
using test::kPatches;
using test::light_of_type;
using test::nested_squares;
using test::squares_with;
using test::unshadowed;

TEST_F(GpuEngineTest, GivesTheLightOfTheProcessorForEveryKindOfBlock) {
  const std::vector<Float3> direct = test::random_light(kPatches, 11, 100);
  for (const Precision precision : {Precision::kF32, Precision::kF16, Precision::kQ8}) {
    for (const std::uint32_t matrices : {1U, 2U, 3U}) {
      const std::array<HierarchicalStorage, 4> storages = {
          test::random_hierarchical_storage(kPatches, matrices, 1),
          test::random_nested_storage(kPatches, matrices, 2),
          test::equilibrated(test::random_nested_storage(kPatches, matrices, 3), 4),
          test::with_roles(test::random_hierarchical_storage(kPatches, matrices, 5))};
      for (std::size_t k = 0; k < storages.size(); ++k) {
        SCOPED_TRACE(precision_name(precision) + ", matrices " + std::to_string(matrices) +
                     ", kind " + std::to_string(k));
        const auto data = squares_with(storages[k], precision);
        Engine engine(data);
        engine.relight(direct);
        GpuEngine gpu(data, eglGetProcAddress);
        const test::FrameBuffers buffers(*data, direct);
        gpu.relight(buffers.names());
        test::expect_frame_of(engine, buffers);
      }
    }
  }
}

TEST_F(GpuEngineTest, GivesTheSameBitsInEveryFrame) {
  const auto data = nested_squares();
  const std::vector<Float3> direct = test::random_light(kPatches, 12, 100);
  GpuEngine first(data, eglGetProcAddress), second(data, eglGetProcAddress);
  const test::FrameBuffers buffers(*data, direct);
  first.relight(buffers.names());
  const std::vector<Float3> radiosity = buffers.radiosity.read(),
                            vertices = buffers.vertices.read();
  for (GpuEngine* const gpu : {&first, &second}) {
    const test::FrameBuffers other(*data, test::random_light(kPatches, 13, 100));
    gpu->relight(other.names());
    EXPECT_NE(radiosity, other.radiosity.read());
    gpu->relight(buffers.names());
    EXPECT_EQ(radiosity, buffers.radiosity.read());
    EXPECT_EQ(vertices, buffers.vertices.read());
  }
}

TEST_F(GpuEngineTest, WritesOnlyWhatIsWanted) {
  const auto data = nested_squares();
  const std::vector<Float3> direct = test::random_light(kPatches, 14, 100);
  GpuEngine gpu(data, eglGetProcAddress);
  const test::FrameBuffers all(*data, direct), some(*data, direct);
  gpu.relight(all.names());
  gpu.relight({.direct_irradiance = some.direct.name(), .vertex_irradiance = some.vertices.name()});
  EXPECT_EQ(all.vertices.read(), some.vertices.read());
  EXPECT_EQ(some.radiosity.read(), std::vector<Float3>(kPatches));
}

TEST_F(GpuEngineTest, TakesAnotherEmission) {
  const auto data = nested_squares();
  const auto other = std::make_shared<TransferData>(*data);
  other->patches.emitted_exitance = test::random_light(kPatches, 16, 100);
  const std::vector<Float3> direct = test::random_light(kPatches, 15, 100);
  const test::FrameBuffers buffers(*data, direct);
  GpuEngine gpu(data, eglGetProcAddress);
  for (const auto& scene :
       std::initializer_list<std::shared_ptr<const TransferData>>{other, data}) {
    Engine engine(scene);
    engine.relight(direct);
    gpu.set_emitted_exitance(engine.emitted_exitance());
    gpu.relight(buffers.names());
    test::expect_frame_of(engine, buffers);
  }
  const std::vector<Float3> few(5), negative(kPatches, {0, -1, 0});
  test::expect_error([&] { gpu.set_emitted_exitance(few); }, "5 entries");
  test::expect_error([&] { gpu.set_emitted_exitance(negative); }, "patch 0 is negative");
}

TEST_F(GpuEngineTest, LeavesTheStateOfTheContext) {
  const auto data = nested_squares();
  const GlFunctions gl(eglGetProcAddress);
  const auto gl_ptr = std::make_shared<const GlFunctions>(gl);
  const ComputeProgram program(gl_ptr, "nothing",
                               "#version 430\nlayout(local_size_x = 1) in; void main() {}");
  program.run(1);  // it stays the current one
  int current = 0;
  gl.get_integer(Gl::kCurrentProgram, &current);
  const test::LightBuffer storage(300U), uniform(300U);
  for (unsigned k = 0; k < 8; ++k) {
    if (k % 2 == 0) {
      gl.bind_buffer_range(Gl::kStorageBuffer, k, storage.name(), 256, 256);
    } else {
      gl.bind_buffer_base(Gl::kStorageBuffer, k, storage.name());
    }
  }
  gl.bind_buffer_range(Gl::kUniformBuffer, 8, uniform.name(), 256, 512);
  gl.bind_buffer(Gl::kUniformBuffer, 0);
  gl.bind_buffer(Gl::kStorageBuffer, uniform.name());
  const test::FrameBuffers buffers(*data, test::random_light(kPatches, 17, 100));
  while (gl.get_error() != 0) {
  }
  const auto expect_unchanged = [&] {
    EXPECT_EQ(gl.get_error(), 0U);
    const auto expect = [&](GlFunctions::Enum name, unsigned wanted) {
      int found = -1;
      gl.get_integer(name, &found);
      EXPECT_EQ(static_cast<unsigned>(found), wanted) << name;
    };
    const auto expect_at = [&](GlFunctions::Enum name, unsigned index, std::int64_t wanted) {
      std::int64_t found = -1;
      gl.get_long_at(name, index, &found);
      EXPECT_EQ(found, wanted) << name << " at " << index;
    };
    expect(Gl::kCurrentProgram, static_cast<unsigned>(current));
    expect(Gl::kStorageBinding, uniform.name());
    expect(Gl::kUniformBinding, 0);
    for (unsigned k = 0; k < 8; ++k) {
      expect_at(Gl::kStorageBinding, k, storage.name());
      expect_at(Gl::kStorageStart, k, k % 2 == 0 ? 256 : 0);
      expect_at(Gl::kStorageSize, k, k % 2 == 0 ? 256 : 0);
    }
    expect_at(Gl::kUniformBinding, 8, uniform.name());
    expect_at(Gl::kUniformStart, 8, 256);
    expect_at(Gl::kUniformSize, 8, 512);
  };
  expect_unchanged();
  {
    GpuEngine gpu(data, eglGetProcAddress);
    expect_unchanged();
    gpu.relight(buffers.names());
    expect_unchanged();
    gpu.set_emitted_exitance(data->patches.emitted_exitance);
    expect_unchanged();
    test::expect_error([&] { gpu.relight({}); }, "is no buffer");
    expect_unchanged();
  }
  expect_unchanged();
}

TEST_F(GpuEngineTest, RefusesBuffersThatDoNotFit) {
  const auto data = nested_squares();
  GpuEngine gpu(data, eglGetProcAddress);
  const test::FrameBuffers buffers(*data, test::random_light(kPatches, 18, 100));
  gpu.relight(buffers.names());
  const std::vector<Float3> before = buffers.radiosity.read();
  const test::LightBuffer small(kPatches - 1);
  const auto refused = [&](unsigned GpuBuffers::*buffer, unsigned name, const char* part) {
    GpuBuffers names = buffers.names();
    names.*buffer = name;
    test::expect_error([&] { gpu.relight(names); }, part);
    EXPECT_EQ(before, buffers.radiosity.read());
  };
  refused(&GpuBuffers::direct_irradiance, 0, "direct irradiance: 0 is no buffer");
  refused(&GpuBuffers::direct_irradiance, 999999, "999999 is no buffer");
  for (const auto buffer : {&GpuBuffers::direct_irradiance, &GpuBuffers::indirect_irradiance,
                            &GpuBuffers::radiosity, &GpuBuffers::vertex_irradiance}) {
    refused(buffer, small.name(), "its buffer has 3876 bytes; it needs ");
  }
  refused(&GpuBuffers::radiosity, buffers.direct.name(), "given for two arrays");
  refused(&GpuBuffers::lightmap_irradiance, small.name(), "no lightmap");
  refused(&GpuBuffers::probe_light, small.name(), "no light probes");
}

TEST_F(GpuEngineTest, RefusesWhatItCannotRun) {
  const auto data = nested_squares();
  test::expect_error([&] { GpuEngine(data, nullptr); }, "the function");
  test::expect_error([&] { GpuEngine(nullptr, eglGetProcAddress); }, "no operator");
  auto dense = std::make_shared<TransferData>();
  test::add_square(*dense, 1, 0, 3, true, {0.5F, 0.5F, 0.5F});
  test::add_even_exchange(*dense);
  test::expect_error([&] { GpuEngine(dense, eglGetProcAddress); }, "this one is dense");
  const auto nothing = [](const char*) -> GlFunction { return nullptr; };
  test::expect_error([&] { GpuEngine(data, nothing); }, "this context has no glGetIntegerv");
}

TEST_F(GpuEngineTest, MeasuresItsStages) {
  const auto data = nested_squares();
  const test::FrameBuffers buffers(*data, test::random_light(kPatches, 22, 100));
  GpuEngine gpu(data, eglGetProcAddress);
  gpu.relight(buffers.names());
  EXPECT_TRUE(gpu.stage_times().empty());
  gpu.measure_stages(true);
  gpu.light_patches({}, buffers.direct.name());
  gpu.relight(buffers.names());
  const std::vector<GpuStageTime> times = gpu.stage_times();
  ASSERT_GE(times.size(), 6U);  // those that have nothing to do are not there
  EXPECT_STREQ(times[0].name, "direct light");
  EXPECT_STREQ(times.back().name, "vertices");
  for (const GpuStageTime& time : times) EXPECT_GE(time.microseconds, 0) << time.name;
  const GpuLamp refused{.light = light_of_type(LightType::kSphere)};
  test::expect_error([&] { gpu.light_patches({&refused, 1}, buffers.direct.name()); }, "lamp 0");
  const std::vector<GpuStageTime> kept = gpu.stage_times();
  ASSERT_EQ(kept.size(), times.size());
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_STREQ(kept[k].name, times[k].name);
    EXPECT_EQ(kept[k].microseconds, times[k].microseconds) << times[k].name;
  }
  gpu.measure_stages(false);
  EXPECT_TRUE(gpu.stage_times().empty());
}

/// Queries of the current context, whose names an engine may have in another one.
std::vector<GLuint> some_queries() {
  std::vector<GLuint> names(50);
  glGenQueries(static_cast<GLsizei>(names.size()), names.data());
  for (const GLuint name : names) {
    glBeginQuery(GL_SAMPLES_PASSED, name);
    glEndQuery(GL_SAMPLES_PASSED);
  }
  return names;
}

TEST_F(GpuEngineTest, RunsInContextsThatShareObjects) {
  const auto data = nested_squares();
  const test::FrameBuffers buffers(*data, test::random_light(kPatches, 24, 100));
  const std::vector<GpuLamp> lamps = a_lamp_of_each_kind();
  auto gpu = std::make_unique<GpuEngine>(data, eglGetProcAddress);
  const auto frame = [&] {
    gpu->light_patches(lamps, buffers.direct.name());
    gpu->relight(buffers.names());
    return buffers.radiosity.read();
  };
  const auto measured_stages = [&] {
    gpu->measure_stages(true);
    frame();
    const std::size_t count = gpu->stage_times().size();
    gpu->measure_stages(false);
    return count;
  };
  const std::vector<Float3> radiosity = frame();
  const std::size_t stage_count = measured_stages();
  EXPECT_GE(stage_count, 6U);
  const test::SharedContext other;
  ASSERT_TRUE(other.use());
  const std::vector<GLuint> queries = some_queries();
  EXPECT_EQ(frame(), radiosity);
  EXPECT_EQ(measured_stages(), stage_count);
  ASSERT_TRUE(other.use_first());
  EXPECT_EQ(frame(), radiosity);
  EXPECT_EQ(measured_stages(), stage_count);
  EXPECT_EQ(glGetError(), 0U);
  ASSERT_TRUE(other.use());
  gpu.reset();
  for (const GLuint name : queries) EXPECT_TRUE(glIsQuery(name)) << name;
  EXPECT_EQ(glGetError(), 0U);
}

TEST_F(GpuEngineTest, SaysWhatTheCompilerSays) {
  const auto gl = std::make_shared<const GlFunctions>(eglGetProcAddress);
  test::expect_error([&] { ComputeProgram(gl, "wrong.glsl", "#version 430\nvoid main() { x; }"); },
                     "the driver refuses the shader wrong.glsl: ");
}

TEST_F(GpuEngineTest, SaysHowMuchMemoryItTakes) {
  const auto data = nested_squares();
  const GpuEngine gpu(data, eglGetProcAddress);
  EXPECT_GT(gpu.bytes(), data->transfer->bytes() / 2);
  const std::size_t of_points = 32 * receiver_points(*data).size();
  EXPECT_GT(gpu.bytes(), of_points);
  EXPECT_LT(gpu.bytes(), of_points + 10 * data->transfer->bytes());
}

TEST_F(GpuEngineTest, RunsFromC) {
  const auto data = nested_squares();
  const std::vector<Float3> direct = test::random_light(kPatches, 19, 100);
  Engine engine(data);
  engine.relight(direct);
  const test::FrameBuffers buffers(*data, direct);
  rebounce_transfer transfer{.data = data};
  rebounce_gpu_engine* gpu = nullptr;
  ASSERT_EQ(rebounce_gpu_engine_create(&transfer, eglGetProcAddress, &gpu), REBOUNCE_OK)
      << rebounce_last_error();
  EXPECT_GT(rebounce_gpu_engine_bytes(gpu), 0U);
  EXPECT_EQ(rebounce_gpu_engine_set_emitted_exitance(
                gpu, data->patches.emitted_exitance.front().data(), kPatches),
            REBOUNCE_OK);
  const std::vector<GpuLamp> lamp = a_lamp_of_each_kind();
  const test::LightBuffer lit(kPatches);
  rebounce_light light;
  rebounce_light_init(&light);
  std::ranges::copy(lamp[0].light.position, light.position);
  std::ranges::copy(lamp[0].light.color, light.color);
  light.intensity = lamp[0].light.intensity;
  light.range = lamp[0].light.range;
  std::array<rebounce_gpu_lamp, 2> lamps;
  for (rebounce_gpu_lamp& each : lamps) {
    rebounce_gpu_lamp_init(&each);
    each.light = &light;
  }
  EXPECT_EQ(rebounce_gpu_engine_light_patches(gpu, lamps.data(), 2, lit.name(), 0), REBOUNCE_OK)
      << rebounce_last_error();
  EXPECT_LE(test::largest_difference(unshadowed(*data, std::array<GpuLamp, 2>{lamp[0], lamp[0]}),
                                     lit.read()),
            1e-4);
  lamps[1].shadow_map = 4;
  EXPECT_EQ(rebounce_gpu_engine_light_patches(gpu, lamps.data(), 2, lit.name(), 0),
            REBOUNCE_INVALID_ARGUMENT);
  lamps[1].light = nullptr;
  EXPECT_EQ(rebounce_gpu_engine_light_patches(gpu, lamps.data(), 2, lit.name(), 0),
            REBOUNCE_INVALID_ARGUMENT);
  const rebounce_sky sky = {{1, 1, 1}, 5};
  EXPECT_EQ(rebounce_gpu_engine_set_sky(gpu, &sky, nullptr), REBOUNCE_OK);

  rebounce_gpu_buffers names;
  rebounce_gpu_buffers_init(&names);
  EXPECT_EQ(rebounce_gpu_engine_relight(gpu, &names), REBOUNCE_INVALID_ARGUMENT);
  names.direct_irradiance = buffers.direct.name();
  names.indirect_irradiance = buffers.indirect.name();
  names.radiosity = buffers.radiosity.name();
  names.vertex_irradiance = buffers.vertices.name();
  EXPECT_EQ(rebounce_gpu_engine_relight(gpu, &names), REBOUNCE_OK);
  test::expect_frame_of(engine, buffers);
  rebounce_gpu_engine_destroy(gpu);
  EXPECT_EQ(rebounce_gpu_engine_create(nullptr, eglGetProcAddress, &gpu),
            REBOUNCE_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace rebounce::test_gpu_engine

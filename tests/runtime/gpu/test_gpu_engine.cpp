#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>

#include "rebounce.h"
#include "rebounce/engine.h"
#include "runtime/frame/c_handles.h"
#include "runtime/gpu/gl_resources.h"
#include "tests/runtime/gpu/gpu_frame.h"
#include "tests/support/expect_error.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/random_light.h"
#include "tests/support/test_scene_data.h"
#include "transfer/format/hierarchical_encoding.h"

// Drivers keep what they allocate: the leak checker of a build with sanitizers looks away.
extern "C" const char* __lsan_default_options() {  // NOLINT: the checker's own name
  return "detect_leaks=0";
}

namespace rebounce::test_gpu_engine {
namespace {

constexpr std::size_t kPatches = 324;  // not a multiple of the alignment

/// Two squares with an operator of random values and random weights of their vertices.
std::shared_ptr<const TransferData> squares_with(HierarchicalStorage storage, Precision precision) {
  auto data = std::make_shared<TransferData>();
  test::add_square(*data, 1, 0, 9, true, {0.5F, 0.4F, 0.3F});
  test::add_square(*data, 1, 2, 9, false, {0.2F, 0.7F, 0.9F});
  data->patches.emitted_exitance[3] = {1, 2, 3};
  data->patches.area = storage.area;
  data->transfer = std::make_shared<const HierarchicalOperator>(encode_values(storage, precision));
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<float> uniform(-0.2F, 0.8F);
  DisplayMesh& mesh = data->mesh;
  mesh.weight_begin = {0};
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    for (std::size_t k = 0; k < v % 4; ++k) {
      mesh.weight_patch.push_back(static_cast<std::uint32_t>(engine() % kPatches));
      mesh.weight.push_back(uniform(engine));
    }
    mesh.weight_begin.push_back(static_cast<std::uint32_t>(mesh.weight.size()));
  }
  return data;
}

std::shared_ptr<const TransferData> nested_squares() {
  return squares_with(test::random_nested_storage(kPatches, 3, 7), Precision::kQ8);
}

class GpuEngineTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!context_.is_current()) GTEST_SKIP() << "there is no OpenGL 4.3 on this machine";
  }

  test::GlContext context_;
};

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

TEST_F(GpuEngineTest, SaysWhatTheCompilerSays) {
  const auto gl = std::make_shared<const GlFunctions>(eglGetProcAddress);
  test::expect_error([&] { ComputeProgram(gl, "wrong.glsl", "#version 430\nvoid main() { x; }"); },
                     "the driver refuses the shader wrong.glsl: ");
}

TEST_F(GpuEngineTest, SaysHowMuchMemoryItTakes) {
  const auto data = nested_squares();
  const GpuEngine gpu(data, eglGetProcAddress);
  EXPECT_GT(gpu.bytes(), data->transfer->bytes() / 2);
  EXPECT_LT(gpu.bytes(), 10 * data->transfer->bytes());
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

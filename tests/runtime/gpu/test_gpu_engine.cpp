#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "rebounce.h"
#include "rebounce/engine.h"
#include "runtime/frame/c_handles.h"
#include "runtime/gpu/gl_resources.h"
#include "runtime/lights/light_sampling.h"
#include "tests/gl/shadow_maps.h"
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
std::shared_ptr<const TransferData> squares_with(const HierarchicalStorage& storage,
                                                 Precision precision) {
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

/// The direct irradiance of `lamps` by their formulas, without shadows.
std::vector<Float3> unshadowed(const TransferData& data, std::span<const GpuLamp> lamps) {
  const std::vector<ReceiverPoint> points = receiver_points(data);
  const std::size_t of_patch = points.size() / data.patches.size();
  std::vector<Float3> irradiance(data.patches.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto& [position, normal] = points[k];
    for (const GpuLamp& lamp : lamps) {
      const IncidentLight light = evaluate_light(lamp.light, position, {});
      const float cosine =
          std::max(0.0F, light.direction[0] * normal[0] + light.direction[1] * normal[1] +
                             light.direction[2] * normal[2]);
      for (int c = 0; c < kChannelCount; ++c) {
        irradiance[k / of_patch][c] += light.illuminance[c] * cosine / static_cast<float>(of_patch);
      }
    }
  }
  return irradiance;
}

Light light_of_type(LightType type) {
  Light light;
  light.type = type;
  light.radius = 1;
  return light;
}

std::vector<GpuLamp> a_lamp_of_each_kind() {
  Light point = light_of_type(LightType::kPoint);
  point.position = {0.3F, 1.2F, 0.4F};
  point.color = {1, 0.5F, 0.25F};
  point.intensity = 50;
  point.range = 9;
  Light spot = point;
  spot.type = LightType::kSpot;
  spot.direction = {0, -0.6F, 0.8F};
  spot.range = 0;
  spot.inner_cone_angle = 0.2F;
  spot.outer_cone_angle = 1;
  Light sun = light_of_type(LightType::kDirectional);
  sun.direction = {0.6F, -0.8F, 0};
  return {{.light = point}, {.light = spot}, {.light = sun}};
}

TEST_F(GpuEngineTest, LightsPatchesByTheFormulasOfLamps) {
  const auto data = nested_squares();
  const std::vector<GpuLamp> lamps = a_lamp_of_each_kind();
  const std::vector<Float3> background = test::random_light(kPatches, 20, 1);
  const test::LightBuffer direct(test::random_light(kPatches, 21, 1)), others(background);
  GpuEngine gpu(data, eglGetProcAddress);
  const auto expect = [&](std::span<const GpuLamp> some, unsigned added,
                          std::vector<Float3> wanted) {
    gpu.light_patches(some, direct.name(), added);
    for (std::size_t i = 0; added != 0 && i < kPatches; ++i) {
      for (int c = 0; c < kChannelCount; ++c) wanted[i][c] += background[i][c];
    }
    EXPECT_LE(test::largest_difference(wanted, direct.read()), 1e-4);
  };
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    const std::span<const GpuLamp> one(&lamps[k], 1);
    const std::vector<Float3> wanted = unshadowed(*data, one);
    EXPECT_GT(std::ranges::max(wanted)[0], 0.01F) << "lamp " << k;
    expect(one, 0, wanted);
  }
  expect(lamps, others.name(), unshadowed(*data, lamps));
  std::vector<GpuLamp> many;
  for (std::size_t k = 0; k < 41; ++k) many.push_back(lamps[k % lamps.size()]);
  expect(many, others.name(), unshadowed(*data, many));
  expect(many, 0, unshadowed(*data, many));
  expect({}, others.name(), std::vector<Float3>(kPatches));
  gpu.light_patches({}, direct.name());
  EXPECT_EQ(direct.read(), std::vector<Float3>(kPatches));
}

TEST_F(GpuEngineTest, RefusesLampsItCannotLight) {
  const auto data = nested_squares();
  const test::LightBuffer direct(kPatches), small(kPatches - 1);
  const test::DepthTexture plane(GL_TEXTURE_2D), cube(GL_TEXTURE_CUBE_MAP);
  GpuEngine gpu(data, eglGetProcAddress);
  const auto refused = [&](const GpuLamp& lamp, const char* part) {
    const std::array<GpuLamp, 2> lamps = {GpuLamp{}, lamp};
    test::expect_error([&] { gpu.light_patches(lamps, direct.name()); }, part);
  };
  refused({.light = light_of_type(LightType::kSphere)}, "lamp 1: the graphics card has");
  Light light;
  light.intensity = -1;
  refused({.light = light}, "lamp 1: ");
  light.intensity = 1;
  light.profile = std::make_shared<const IntensityProfile>(
      IntensityProfile{.vertical = {0}, .horizontal = {0}, .candela = {1}});
  refused({.light = light}, "without profiles");
  const std::vector<GpuShadowView> views(9);
  GpuLamp lamp;
  lamp.shadow_map = GpuShadowMap::kPlane;
  lamp.texture = plane.name();
  lamp.views = views;
  refused(lamp, "has 9 views");
  lamp.views = {};
  refused(lamp, "has 0 views");
  lamp.views = std::span(views).first(1);
  lamp.texture = cube.name();
  refused(lamp, "is no texture of the kind");
  lamp.texture = 999999;
  refused(lamp, "999999 is no texture of the kind");
  lamp.shadow_map = GpuShadowMap::kCube;
  lamp.texture = cube.name();
  lamp.depth_range = {1, 1};
  refused(lamp, "two distances above 0");
  lamp.depth_range = {0, 1};
  refused(lamp, "two distances above 0");
  lamp.depth_range = {1, 2};
  lamp.light.type = LightType::kDirectional;
  refused(lamp, "a cube around a directional light");
  GpuLamp without_shadow;
  const std::vector<GpuShadowView> unused(100);
  without_shadow.views = unused;
  EXPECT_NO_THROW(gpu.light_patches({&without_shadow, 1}, direct.name())) << "views do not count";
  test::expect_error([&] { gpu.light_patches({}, small.name()); }, "direct irradiance: its buffer");
  test::expect_error([&] { gpu.light_patches({}, direct.name(), small.name()); },
                     "light of others: its buffer");
  test::expect_error([&] { gpu.light_patches({}, direct.name(), direct.name()); },
                     "given for two arrays");
  test::expect_error([&] { GpuEngine(data, eglGetProcAddress, {.points_per_patch = 0}); },
                     "points_per_patch is 0");
}

/// A lamp with the views of a shadow map.
GpuLamp lamp_with_map(GpuShadowMap kind, const test::DepthTexture& texture,
                      std::span<const GpuShadowView> views) {
  return {.light = {}, .shadow_map = kind, .texture = texture.name(), .views = views};
}

TEST_F(GpuEngineTest, RefusesShadowMapsWithoutTheirStorage) {
  const auto data = nested_squares();
  const std::vector<Float3> before = test::random_light(kPatches, 23, 100);
  const test::LightBuffer direct(before);
  GpuEngine gpu(data, eglGetProcAddress);
  const auto refused = [&](const GpuLamp& lamp, const std::string& part) {
    const std::array<GpuLamp, 2> lamps = {GpuLamp{}, lamp};
    test::expect_error([&] { gpu.light_patches(lamps, direct.name()); },
                       ("lamp 1: " + part).c_str());
    EXPECT_EQ(direct.read(), before);
    EXPECT_EQ(glGetError(), 0U);
  };
  const auto of_texture = [](const test::DepthTexture& texture, const char* part) {
    return "texture " + std::to_string(texture.name()) + part;
  };
  const std::array<GpuShadowView, 2> views = {GpuShadowView{.layer = 0}, {.layer = 2}};
  const test::DepthTexture no_plane(GL_TEXTURE_2D, 0), no_layers(GL_TEXTURE_2D_ARRAY, 0),
      no_cube(GL_TEXTURE_CUBE_MAP, 0), half_a_cube(GL_TEXTURE_CUBE_MAP, 0), color(GL_TEXTURE_2D, 0),
      upper(GL_TEXTURE_2D, 0), plane(GL_TEXTURE_2D), two(GL_TEXTURE_2D_ARRAY, 2),
      three(GL_TEXTURE_2D_ARRAY, 3);
  const auto allocate = [](GLenum target, GLint level, GLenum format) {
    glTexImage2D(target, level, static_cast<GLint>(format), 4, 4, 0,
                 format == GL_RGBA8 ? GL_RGBA : GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  };
  glBindTexture(GL_TEXTURE_CUBE_MAP, half_a_cube.name());
  for (GLenum face = 0; face < 3; ++face)
    allocate(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, 0, GL_DEPTH_COMPONENT32F);
  glBindTexture(GL_TEXTURE_2D, color.name());
  allocate(GL_TEXTURE_2D, 0, GL_RGBA8);
  glBindTexture(GL_TEXTURE_2D, upper.name());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_BASE_LEVEL, 1);
  allocate(GL_TEXTURE_2D, 1, GL_DEPTH_COMPONENT32F);
  for (const test::DepthTexture* const texture : {&no_plane, &color})
    refused(lamp_with_map(GpuShadowMap::kPlane, *texture, views),
            of_texture(*texture, " has no storage for depths"));
  for (const test::DepthTexture* const texture : {&no_cube, &half_a_cube})
    refused(lamp_with_map(GpuShadowMap::kCube, *texture, {}),
            of_texture(*texture, " has no storage for depths"));
  refused(lamp_with_map(GpuShadowMap::kLayers, no_layers, views),
          of_texture(no_layers, " has no storage for depths"));
  refused(lamp_with_map(GpuShadowMap::kLayers, two, views),
          "a view is in layer 2, and " + of_texture(two, " has 2 layers"));
  const std::array<GpuLamp, 3> good = {lamp_with_map(GpuShadowMap::kLayers, three, views),
                                       lamp_with_map(GpuShadowMap::kPlane, plane, views),
                                       lamp_with_map(GpuShadowMap::kPlane, upper, views)};
  EXPECT_NO_THROW(gpu.light_patches(good, direct.name())) << "planes have no layers";
}

TEST_F(GpuEngineTest, LeavesTheTexturesOfTheContext) {
  const auto data = nested_squares();
  const test::LightBuffer direct(kPatches);
  const test::DepthTexture plane(GL_TEXTURE_2D), other_plane(GL_TEXTURE_2D),
      cube(GL_TEXTURE_CUBE_MAP);
  GpuEngine gpu(data, eglGetProcAddress);
  unsigned sampler = 0;
  glGenSamplers(1, &sampler);
  constexpr unsigned kOfPlane = GlTextureGuard::unit(0, 0), kOfCube = GlTextureGuard::unit(2, 1);
  glActiveTexture(GL_TEXTURE0 + kOfPlane);
  glBindTexture(GL_TEXTURE_2D, other_plane.name());
  glBindSampler(kOfPlane, sampler);
  glActiveTexture(GL_TEXTURE3);
  while (glGetError() != 0) {
  }
  const std::vector<GpuShadowView> views(1);
  std::array<GpuLamp, 2> lamps;
  lamps[0].shadow_map = GpuShadowMap::kPlane;
  lamps[0].texture = plane.name();
  lamps[0].views = views;
  lamps[1].shadow_map = GpuShadowMap::kCube;
  lamps[1].texture = cube.name();
  for (const bool refuses : {false, true}) {
    if (refuses) {
      lamps[1].texture = plane.name();
      test::expect_error([&] { gpu.light_patches(lamps, direct.name()); }, "lamp 1");
    } else {
      gpu.light_patches(lamps, direct.name());
    }
    EXPECT_EQ(glGetError(), 0U);
    const auto value = [](GLenum name) {
      int found = -1;
      glGetIntegerv(name, &found);
      return static_cast<unsigned>(found);
    };
    EXPECT_EQ(value(GL_ACTIVE_TEXTURE), static_cast<unsigned>(GL_TEXTURE3));
    glActiveTexture(GL_TEXTURE0 + kOfPlane);
    EXPECT_EQ(value(GL_TEXTURE_BINDING_2D), other_plane.name());
    EXPECT_EQ(value(GL_SAMPLER_BINDING), sampler);
    glActiveTexture(GL_TEXTURE0 + kOfCube);
    EXPECT_EQ(value(GL_TEXTURE_BINDING_CUBE_MAP), 0U);
    EXPECT_EQ(value(GL_SAMPLER_BINDING), 0U);
    glActiveTexture(GL_TEXTURE3);
  }
  glDeleteSamplers(1, &sampler);
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

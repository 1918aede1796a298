// Direct light of patches on the graphics card.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/gpu/gl_resources.h"
#include "tests/gl/shadow_maps.h"
#include "tests/runtime/gpu/gpu_engine_test.h"
#include "tests/runtime/gpu/gpu_frame.h"
#include "tests/support/expect_error.h"
#include "tests/support/random_light.h"

namespace rebounce::test_gpu_direct_light {
namespace {

using test::a_lamp_of_each_kind;
using test::GpuEngineTest;
using test::kPatches;
using test::light_of_type;
using test::nested_squares;
using test::unshadowed;

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

}  // namespace
}  // namespace rebounce::test_gpu_direct_light

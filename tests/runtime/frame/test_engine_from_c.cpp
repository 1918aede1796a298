// The C interface from within, where allocations can be counted; tests/consumer uses it from C.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <thread>

#include "rebounce.h"
#include "rebounce/engine.h"
#include "tests/runtime/frame/from_c.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/thread_pool.h"

namespace rebounce::test_engine_from_c {
namespace {

using test::FromC;

TEST_F(FromC, ReadsAFileFromMemory) {
  std::string file = bytes();
  rebounce_transfer* read = nullptr;
  ASSERT_EQ(rebounce_transfer_read(file.data(), file.size(), "room", &read), REBOUNCE_OK);
  rebounce_engine* engine = nullptr;
  ASSERT_EQ(rebounce_engine_create(read, nullptr, &engine), REBOUNCE_OK);
  file.assign(file.size(), 'x');  // it keeps a copy
  ASSERT_EQ(rebounce_engine_relight(engine, &lamp_, 1, nullptr), REBOUNCE_OK);
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  const std::size_t count = 3 * std::size_t{info().patch_count};
  const std::span light(rebounce_engine_radiosity(engine), count);
  EXPECT_TRUE(std::ranges::equal(light, std::span(rebounce_engine_radiosity(engine_), count)));
  rebounce_engine_destroy(engine);
  rebounce_transfer_release(read);
}

TEST_F(FromC, RefusesMemoryThatIsNoFile) {
  const std::string file = bytes();
  rebounce_transfer* read = nullptr;
  EXPECT_EQ(rebounce_transfer_read(file.data(), file.size() - 1, "room", &read),
            REBOUNCE_BAD_INPUT);
  EXPECT_EQ(std::string(rebounce_last_error()).find("room"), 0U);
  EXPECT_EQ(read, nullptr);
  EXPECT_EQ(rebounce_transfer_read(nullptr, 0, "room", &read), REBOUNCE_INVALID_ARGUMENT);
}

// A caller may end the handle of before without a look at the status.
TEST_F(FromC, WhatFailsLeavesNoHandle) {
  const auto old_transfer = reinterpret_cast<rebounce_transfer*>(&lamp_);
  const auto old_engine = reinterpret_cast<rebounce_engine*>(&lamp_);
  rebounce_transfer* transfer = old_transfer;
  EXPECT_NE(rebounce_transfer_read(nullptr, 0, "room", &transfer), REBOUNCE_OK);
  EXPECT_EQ(transfer, nullptr);
  transfer = old_transfer;
  EXPECT_NE(rebounce_transfer_load(nullptr, &transfer), REBOUNCE_OK);
  EXPECT_EQ(transfer, nullptr);
  rebounce_engine* engine = old_engine;
  EXPECT_NE(rebounce_engine_create(nullptr, nullptr, &engine), REBOUNCE_OK);
  EXPECT_EQ(engine, nullptr);
  engine = old_engine;
  EXPECT_NE(rebounce_engine_clone(nullptr, &engine), REBOUNCE_OK);
  EXPECT_EQ(engine, nullptr);
  auto* profile = reinterpret_cast<rebounce_ies_profile*>(&lamp_);
  EXPECT_NE(rebounce_ies_profile_parse(nullptr, 0, "lamp", &profile), REBOUNCE_OK);
  EXPECT_EQ(profile, nullptr);
  auto* estimator = reinterpret_cast<rebounce_error_estimator*>(&lamp_);
  EXPECT_NE(rebounce_error_estimator_create(nullptr, &estimator), REBOUNCE_OK);
  EXPECT_EQ(estimator, nullptr);
}

TEST_F(FromC, AFrameDoesNotAllocate) {
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  const int count = test::count_allocations([&] {
    lamp_.position[0] += 0.1F;
    rebounce_engine_relight(engine_, &lamp_, 1, nullptr);
  });
  EXPECT_EQ(count, 0);
}

TEST_F(FromC, TheLightmapIsThatOfTheVertices) {
  rebounce_transfer_info info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
  ASSERT_EQ(info.lightmap_width, info.triangle_count);
  ASSERT_EQ(info.lightmap_height, 1U);
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  std::vector<float> vertex(3 * std::size_t{info.vertex_count});
  std::vector<float> texel(3 * std::size_t{info.triangle_count});
  ASSERT_EQ(rebounce_engine_vertex_irradiance(engine_, vertex.data(), info.vertex_count),
            REBOUNCE_OK);
  EXPECT_EQ(test::count_allocations([&] {
              rebounce_engine_lightmap_irradiance(engine_, texel.data(), info.triangle_count);
            }),
            0);
  const std::uint32_t* const corner = rebounce_transfer_triangle(transfer_);
  for (std::size_t t = 0; t < info.triangle_count; ++t) {
    float mean = 0;
    for (std::size_t k = 0; k < 3; ++k) mean += vertex[3 * corner[3 * t + k]] / 3;
    EXPECT_NEAR(texel[3 * t], mean, 1e-5F * mean);
  }
  EXPECT_EQ(rebounce_transfer_lightmap_texcoord(transfer_)[0], 0.5F);
  EXPECT_EQ(rebounce_transfer_lightmap_triangle(transfer_)[0], 1);
  EXPECT_EQ(rebounce_engine_lightmap_irradiance(engine_, texel.data(), 1),
            REBOUNCE_INVALID_ARGUMENT);
  EXPECT_EQ(rebounce_engine_lightmap_irradiance(engine_, nullptr, 1), REBOUNCE_INVALID_ARGUMENT);
}

TEST_F(FromC, BentNormalsFollowTheHarmonicsOfTheVertices) {
  rebounce_transfer_info info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  std::vector<float> light(12 * std::size_t{info.vertex_count});
  EXPECT_EQ(test::count_allocations(
                [&] { rebounce_engine_vertex_light(engine_, light.data(), info.vertex_count); }),
            0);
  EXPECT_EQ(rebounce_engine_vertex_light(engine_, light.data(), 1), REBOUNCE_INVALID_ARGUMENT);
  // Light from above alone: a normal that is bent away gets less.
  const std::array<float, 12> from_above = {1, 1, 1, 1, 1, 1};
  const std::array<float, 3> irradiance = {1, 2, 3}, up = {0, 1, 0}, bent = {0.6F, 0.8F, 0};
  std::array<float, 3> result{};
  rebounce_bent_irradiance(from_above.data(), irradiance.data(), up.data(), up.data(),
                           result.data());
  EXPECT_EQ(result, irradiance);
  rebounce_bent_irradiance(from_above.data(), irradiance.data(), up.data(), bent.data(),
                           result.data());
  EXPECT_LT(result[0], 0.95F);
  EXPECT_GT(result[0], 0.8F);
}

TEST_F(FromC, ASkyHasADistributionWhereTheFileKnowsItsCells) {
  std::array<float, REBOUNCE_SKY_CELL_COUNT> sky{};
  const std::array<float, 3> down = {0, -1, 0};
  EXPECT_EQ(rebounce_cie_sky(1, down.data(), 0.2F, sky.data()), REBOUNCE_OK);
  EXPECT_NEAR(sky[145], 1, 0.01);
  EXPECT_EQ(rebounce_cie_sky(77, down.data(), 0.2F, sky.data()), REBOUNCE_INVALID_ARGUMENT);
  EXPECT_EQ(rebounce_engine_set_sky_distribution(engine_, sky.data()), REBOUNCE_OK);
  const rebounce_sky bright = {{1, 1, 1}, 1000};
  EXPECT_EQ(rebounce_engine_relight(engine_, nullptr, 0, &bright), REBOUNCE_OK);
  const float* const direct = rebounce_engine_direct_irradiance(engine_);
  EXPECT_NEAR(direct[0], 3.14159F * 1000 * 0.5F * sky[145], 0.1F);
  sky[3] = -1;
  EXPECT_EQ(rebounce_engine_set_sky_distribution(engine_, sky.data()), REBOUNCE_INVALID_ARGUMENT);
  EXPECT_EQ(rebounce_engine_set_sky_distribution(engine_, nullptr), REBOUNCE_OK);
}

TEST_F(FromC, MaterialsCamerasAndErrorsAreTold) {
  const rebounce_transfer_info told = info();
  EXPECT_EQ(told.material_count, 2U);
  EXPECT_STREQ(rebounce_transfer_material_name(transfer_, 0), "plaster");
  EXPECT_STREQ(rebounce_transfer_material_name(transfer_, 1), "screen");
  EXPECT_EQ(rebounce_transfer_material_name(transfer_, 2), nullptr);
  EXPECT_EQ(rebounce_transfer_material_luminance(transfer_, 0)[2], 0);
  EXPECT_EQ(rebounce_transfer_material_luminance(transfer_, 1)[2], 3);
  EXPECT_EQ(rebounce_transfer_material_luminance(nullptr, 0), nullptr);
  EXPECT_EQ(rebounce_transfer_triangle_material(transfer_)[5], 1U);
  EXPECT_EQ(told.error_mean, 0.25F);
  EXPECT_EQ(told.error_max, 0.5F);
  EXPECT_EQ(told.error_bound, 0.75F);

  EXPECT_EQ(told.camera_count, 2U);
  rebounce_camera camera;
  rebounce_camera_init(&camera);
  EXPECT_EQ(camera.backward[2], 1);
  ASSERT_EQ(rebounce_transfer_get_camera(transfer_, 1, &camera), REBOUNCE_OK);
  EXPECT_EQ(camera.position[2], 3);
  EXPECT_EQ(camera.vertical_fov, 0.5F);
  EXPECT_STREQ(rebounce_transfer_camera_name(transfer_, 1), "door");
  EXPECT_STREQ(rebounce_transfer_camera_name(transfer_, 0), "");
  EXPECT_EQ(rebounce_transfer_camera_name(transfer_, 2), nullptr);
  EXPECT_EQ(rebounce_transfer_get_camera(transfer_, 2, &camera), REBOUNCE_INVALID_ARGUMENT);
  EXPECT_STREQ(rebounce_last_error(), "there is no camera 2; the scene has 2");
}

TEST_F(FromC, LightAtVerticesIsThatOfTheWeightsAndNeverNegative) {
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  const std::uint32_t count = info().vertex_count;
  const std::uint32_t* const begin = rebounce_transfer_vertex_weight_begin(transfer_);
  const std::uint32_t* const patch = rebounce_transfer_vertex_weight_patch(transfer_);
  const float* const weight = rebounce_transfer_vertex_weight(transfer_);
  std::vector<float> direct(3 * std::size_t{count}), indirect(direct.size());
  EXPECT_EQ(test::count_allocations([&] {
              rebounce_engine_vertex_direct_irradiance(engine_, direct.data(), count);
              rebounce_engine_vertex_irradiance(engine_, indirect.data(), count);
            }),
            0);
  for (std::uint32_t v = 0; v < count; ++v) {
    float of_direct = 0, of_indirect = 0;
    for (std::uint32_t k = begin[v]; k < begin[v + 1]; ++k) {
      of_direct += weight[k] * rebounce_engine_direct_irradiance(engine_)[3 * patch[k]];
      of_indirect += weight[k] * rebounce_engine_indirect_irradiance(engine_)[3 * patch[k]];
    }
    EXPECT_FLOAT_EQ(direct[3 * v], std::max(0.0F, of_direct));
    EXPECT_FLOAT_EQ(indirect[3 * v], std::max(0.0F, of_indirect));
  }
  EXPECT_GT(direct[3], 0);
  // A frame with the light of the last patch alone takes the first vertex below 0.
  std::vector<float> last(3 * std::size_t{info().patch_count}, 0.0F);
  std::fill(last.end() - 3, last.end(), 5.0F);
  ASSERT_EQ(rebounce_engine_relight_direct(engine_, last.data(), info().patch_count), REBOUNCE_OK);
  rebounce_engine_vertex_direct_irradiance(engine_, direct.data(), count);
  EXPECT_EQ(direct[0], 0);
  EXPECT_EQ(direct.back(), 5);
  EXPECT_EQ(rebounce_engine_vertex_direct_irradiance(engine_, direct.data(), count - 1),
            REBOUNCE_INVALID_ARGUMENT);
}

TEST_F(FromC, DirectLightIsTheMeanOverTheReceiverPoints) {
  constexpr std::size_t kPoints = 8;
  const std::size_t n = info().patch_count;
  std::vector<float> position(3 * kPoints * n), normal(position.size());
  ASSERT_EQ(rebounce_transfer_receiver_points(transfer_, kPoints, position.data(), normal.data(),
                                              kPoints * n),
            REBOUNCE_OK);
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0;
    for (std::size_t k = kPoints * i; k < kPoints * (i + 1); ++k) {
      double along = 0, squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double path = double{lamp_.position[axis]} - position[3 * k + axis];
        along += path * normal[3 * k + axis];
        squared += path * path;
      }
      sum += std::max(0.0, along) / std::pow(squared, 1.5);  // nothing is in between
    }
    EXPECT_NEAR(rebounce_engine_direct_irradiance(engine_)[3 * i], sum / kPoints, 1e-5 * sum);
  }
  EXPECT_EQ(rebounce_transfer_receiver_points(transfer_, 4, position.data(), normal.data(), 5),
            REBOUNCE_INVALID_ARGUMENT);
  EXPECT_EQ(rebounce_transfer_receiver_points(transfer_, 0, position.data(), normal.data(), 0),
            REBOUNCE_INVALID_ARGUMENT);
}

TEST_F(FromC, ALuminaireHasAProfile) {
  const std::string text =
      "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 100\n0 45 90\n0\n200 100 0\n";
  rebounce_ies_profile* profile = nullptr;
  ASSERT_EQ(rebounce_ies_profile_parse(text.data(), text.size(), "lamp.ies", &profile), REBOUNCE_OK)
      << rebounce_last_error();
  lamp_.profile = profile;
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  const std::size_t numbers = 3 * std::size_t{info().patch_count};
  const float* const direct = rebounce_engine_direct_irradiance(engine_);
  const std::vector<float> shaped(direct, direct + numbers);
  rebounce_ies_profile_destroy(profile);

  // The same by the C++ interface.
  Engine engine(load_transfer(folder_ / "room.safetensors"));
  Light lamp;
  lamp.position = {lamp_.position[0], lamp_.position[1], lamp_.position[2]};
  lamp.profile = parse_ies_profile(text, "lamp.ies");
  engine.relight({&lamp, 1}, {});
  EXPECT_EQ(0,
            std::memcmp(shaped.data(), engine.direct_irradiance().data(), numbers * sizeof(float)));
  EXPECT_GT(shaped[0], 10);

  ASSERT_EQ(rebounce_ies_profile_parse("no", 2, "lamp.ies", &profile), REBOUNCE_BAD_INPUT);
  EXPECT_EQ(profile, nullptr);
  EXPECT_NE(std::string(rebounce_last_error()).find("lamp.ies"), std::string::npos);
}

TEST_F(FromC, AFrameRunsOnTheThreadsOfTheCaller) {
  test::ThreadPool pool(3);
  rebounce_engine_settings settings;
  rebounce_engine_settings_init(&settings);
  EXPECT_EQ(settings.parallel_for, nullptr);
  settings.parallel_for = pool.scheduler().parallel_for;
  settings.user = pool.scheduler().user;
  rebounce_engine *pooled = nullptr, *clone = nullptr;
  ASSERT_EQ(rebounce_engine_create(transfer_, &settings, &pooled), REBOUNCE_OK);
  ASSERT_EQ(rebounce_engine_clone(pooled, &clone), REBOUNCE_OK);
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  const float* const expected = rebounce_engine_radiosity(engine_);
  rebounce_transfer_info info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
  int loops = 0;
  for (rebounce_engine* const engine : {pooled, clone}) {
    EXPECT_EQ(test::count_allocations([&] { rebounce_engine_relight(engine, &lamp_, 1, nullptr); }),
              0);
    EXPECT_TRUE(std::equal(expected, expected + 3 * std::size_t{info.patch_count},
                           rebounce_engine_radiosity(engine)));
    EXPECT_GT(pool.loop_count(), loops);
    loops = pool.loop_count();
    rebounce_engine_destroy(engine);
  }
}

TEST_F(FromC, AnErrorIsALineAndBelongsToItsThread) {
  lamp_.struct_size = 4;
  EXPECT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_INVALID_ARGUMENT);
  const std::string here = rebounce_last_error();
  EXPECT_NE(here.find("struct_size"), std::string::npos);
  EXPECT_EQ(here.find('\n'), std::string::npos);
  std::thread([] { EXPECT_STREQ(rebounce_last_error(), ""); }).join();
}

TEST_F(FromC, AMessageNamesTheLightOrTheFunctionThatFillsTheStructure) {
  std::array<rebounce_light, 3> lights = {lamp_, lamp_, lamp_};
  lights[2].intensity = NAN;
  EXPECT_EQ(rebounce_engine_relight(engine_, lights.data(), 3, nullptr), REBOUNCE_INVALID_ARGUMENT);
  EXPECT_TRUE(std::string(rebounce_last_error()).starts_with("light 2: ")) << rebounce_last_error();
  lights[0].struct_size = 0;
  rebounce_engine_relight(engine_, lights.data(), 1, nullptr);
  EXPECT_NE(std::string(rebounce_last_error()).find("rebounce_light_init"), std::string::npos);
  rebounce_transfer_info unfilled{};
  rebounce_transfer_get_info(transfer_, &unfilled);
  EXPECT_NE(std::string(rebounce_last_error()).find("rebounce_transfer_info_init"),
            std::string::npos);
  rebounce_camera camera{};
  rebounce_transfer_get_camera(transfer_, 0, &camera);
  EXPECT_NE(std::string(rebounce_last_error()).find("rebounce_camera_init"), std::string::npos);
  rebounce_engine_settings settings{};
  rebounce_engine* none = nullptr;
  rebounce_engine_create(transfer_, &settings, &none);
  EXPECT_NE(std::string(rebounce_last_error()).find("rebounce_engine_settings_init"),
            std::string::npos);
}

TEST_F(FromC, LightOfTheCallersIsRefusedWithItsPatchAndTheLastFrameStays) {
  ASSERT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_OK);
  const std::size_t n = info().patch_count;
  const float* const radiosity = rebounce_engine_radiosity(engine_);
  const std::vector<float> before(radiosity, radiosity + 3 * n);
  for (const float bad : {NAN, INFINITY, -1.0F}) {
    std::vector<float> direct(3 * n, 1.0F);
    direct[3 * 7 + 1] = bad;
    EXPECT_EQ(rebounce_engine_relight_direct(engine_, direct.data(), n), REBOUNCE_INVALID_ARGUMENT);
    EXPECT_NE(std::string(rebounce_last_error()).find("patch 7 "), std::string::npos);
    EXPECT_TRUE(std::equal(before.begin(), before.end(), rebounce_engine_radiosity(engine_)));
  }
}

TEST_F(FromC, LightsOutOfRangeAreRefused) {
  const auto refused = [&](auto change) {
    rebounce_light light = lamp_;
    change(light);
    return rebounce_engine_relight(engine_, &light, 1, nullptr) == REBOUNCE_INVALID_ARGUMENT;
  };
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_TRUE(refused([](auto& l) { l.type = 6; }));
  EXPECT_TRUE(refused([](auto& l) { l.position[2] = NAN; }));
  EXPECT_TRUE(refused([](auto& l) { l.color[0] = -1; }));
  EXPECT_TRUE(refused([](auto& l) { l.intensity = INFINITY; }));
  EXPECT_TRUE(refused([](auto& l) { l.range = -1; }));
  EXPECT_TRUE(refused([](auto& l) { l.type = REBOUNCE_LIGHT_SPHERE; }));  // no radius
  EXPECT_TRUE(refused([](auto& l) { l.type = REBOUNCE_LIGHT_RECTANGLE; }));
  EXPECT_TRUE(refused([](auto& l) {
    l.type = REBOUNCE_LIGHT_SPOT;
    l.direction[1] = -2;
  }));
  EXPECT_TRUE(refused([](auto& l) {
    l.type = REBOUNCE_LIGHT_SPOT;
    l.inner_cone_angle = 1;
  }));
  const rebounce_sky dark = {{1, 1, 1}, -1};
  EXPECT_EQ(rebounce_engine_relight(engine_, nullptr, 0, &dark), REBOUNCE_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace rebounce::test_engine_from_c

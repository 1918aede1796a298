// The C interface from within, where allocations can be counted; tests/consumer uses it from C.

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <thread>

#include "rebounce.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scene_data.h"
#include "tests/support/thread_pool.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_engine_from_c {
namespace {

class FromC : public testing::Test {
 protected:
  void SetUp() override {
    TransferData data;
    test::add_square(data, 1, 0, 4, true, {0.5F, 0.4F, 0.3F});
    test::add_square(data, 1, 2, 4, false, {0.2F, 0.7F, 0.9F});
    test::add_even_exchange(data);
    DisplayMesh& mesh = data.mesh;
    mesh.base_color_texcoord.resize(mesh.position.size());
    mesh.emissive_texcoord.resize(mesh.position.size());
    mesh.vertex_color.resize(mesh.position.size());
    mesh.weight_begin.resize(mesh.position.size() + 1);
    data.materials.resize(1);
    data.lightmap = one_texel_for_each(mesh);
    data.surface_harmonics.sky.assign(data.patches.size(), LinearHarmonics{1, 1});
    data.surface_harmonics.entry_begin.assign(data.patches.size() + 1, 0);
    add_zenith(data);
    const std::string path = (folder_ / "room.safetensors").string();
    save_transfer_file(path, data);
    ASSERT_EQ(rebounce_transfer_load(path.c_str(), &transfer_), REBOUNCE_OK);
    ASSERT_EQ(rebounce_engine_create(transfer_, nullptr, &engine_), REBOUNCE_OK);
    rebounce_light_init(&lamp_);
    lamp_.position[1] = 1;
  }
  void TearDown() override {
    rebounce_engine_destroy(engine_);
    rebounce_transfer_release(transfer_);
  }

  /// Every patch sees half of its sky in the zenith.
  static void add_zenith(TransferData& data) {
    data.sky_cells.entry_begin = {0};
    for (std::uint32_t i = 0; i < data.patches.size(); ++i) {
      data.sky_cells.entry_begin.push_back(i + 1);
      data.sky_cells.entry_cell.push_back(145);
      data.sky_cells.entry_part.push_back(0.5F);
    }
  }

  /// A lightmap of one row, with the middle of each triangle.
  static Lightmap one_texel_for_each(const DisplayMesh& mesh) {
    Lightmap map;
    map.width = static_cast<std::uint32_t>(mesh.triangle.size());
    map.height = 1;
    map.texcoord.assign(mesh.position.size(), Float2{0.5F, 0.5F});
    map.has_texels.assign(map.width, 1);
    map.weight.assign(map.width, Float2{1 / 3.0F, 1 / 3.0F});
    for (std::uint32_t t = 0; t < map.width; ++t) map.triangle.push_back(t);
    return map;
  }

  test::TemporaryFolder folder_;
  rebounce_transfer* transfer_ = nullptr;
  rebounce_engine* engine_ = nullptr;
  rebounce_light lamp_{};
};

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

TEST_F(FromC, ProgramsThatKnowNoLightmapGetTheInfoTheyKnow) {
  rebounce_transfer_info info{};
  info.struct_size = offsetof(rebounce_transfer_info, lightmap_width);
  info.lightmap_width = 77;  // memory that is not the structure's
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
  EXPECT_GT(info.patch_count, 0U);
  EXPECT_EQ(info.lightmap_width, 77U);
}

/// The structures as they were in version 1 of the interface.
struct LightOfVersion1 {
  std::uint32_t struct_size, type;
  std::array<float, 3> position, direction, color;
  float intensity, range, inner_cone_angle, outer_cone_angle, radius;
  std::array<float, 2> size;
  std::array<float, 3> tangent;
};
struct SettingsOfVersion1 {
  std::uint32_t struct_size, points_per_patch, area_light_samples, light_capacity;
};

TEST_F(FromC, StructuresOfVersion1AreUnderstood) {
  const SettingsOfVersion1 settings = {sizeof(settings), 8, 4, 16};
  rebounce_engine* older = nullptr;
  ASSERT_EQ(rebounce_engine_create(
                transfer_, reinterpret_cast<const rebounce_engine_settings*>(&settings), &older),
            REBOUNCE_OK)
      << rebounce_last_error();
  std::array<LightOfVersion1, 2> lights{};
  std::array<rebounce_light, 2> present{};
  for (std::size_t k = 0; k < 2; ++k) {
    lamp_.position[0] = 0.3F * static_cast<float>(k);
    present[k] = lamp_;
    std::memcpy(&lights[k], &lamp_, sizeof(LightOfVersion1));
    lights[k].struct_size = sizeof(LightOfVersion1);
  }
  const auto* const as_given = reinterpret_cast<const rebounce_light*>(lights.data());
  ASSERT_EQ(rebounce_engine_relight(older, as_given, 2, nullptr), REBOUNCE_OK)
      << rebounce_last_error();
  ASSERT_EQ(rebounce_engine_relight(engine_, present.data(), 2, nullptr), REBOUNCE_OK);
  rebounce_transfer_info info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
  const float* const expected = rebounce_engine_radiosity(engine_);
  EXPECT_GT(expected[0], 0);
  EXPECT_TRUE(std::equal(expected, expected + 3 * std::size_t{info.patch_count},
                         rebounce_engine_radiosity(older)));
  rebounce_engine_destroy(older);
  lights[0].struct_size -= 4;
  EXPECT_EQ(rebounce_engine_relight(engine_, as_given, 1, nullptr), REBOUNCE_INVALID_ARGUMENT);
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

TEST_F(FromC, StructuresOfALaterVersionAreUnderstood) {
  struct LaterLight {
    rebounce_light light;
    float something_new[5];
  };
  std::array<LaterLight, 2> later{};
  std::array<rebounce_light, 2> now{};
  for (std::size_t k = 0; k < 2; ++k) {
    now[k] = lamp_;
    now[k].position[0] = 0.3F * static_cast<float>(k);
    later[k].light = now[k];
    later[k].light.struct_size = sizeof(LaterLight);
  }
  ASSERT_EQ(rebounce_engine_relight(engine_, now.data(), 2, nullptr), REBOUNCE_OK);
  rebounce_transfer_info info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
  const float* const direct = rebounce_engine_direct_irradiance(engine_);
  const std::vector<float> before(direct, direct + 3 * std::size_t{info.patch_count});
  ASSERT_EQ(rebounce_engine_relight(engine_, &later[0].light, 2, nullptr), REBOUNCE_OK);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), direct));
}

TEST_F(FromC, AnErrorIsALineAndBelongsToItsThread) {
  lamp_.struct_size = 4;
  EXPECT_EQ(rebounce_engine_relight(engine_, &lamp_, 1, nullptr), REBOUNCE_INVALID_ARGUMENT);
  const std::string here = rebounce_last_error();
  EXPECT_NE(here.find("struct_size"), std::string::npos);
  EXPECT_EQ(here.find('\n'), std::string::npos);
  std::thread([] { EXPECT_STREQ(rebounce_last_error(), ""); }).join();
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

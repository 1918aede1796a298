// Structures of the C interface that callers know fewer or more members of.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "rebounce.h"
#include "tests/runtime/frame/from_c.h"

namespace rebounce::test_structures_from_c {
namespace {

using test::FromC;

TEST_F(FromC, ProgramsThatKnowNoLightmapGetTheInfoTheyKnow) {
  rebounce_transfer_info info{};
  info.struct_size = offsetof(rebounce_transfer_info, lightmap_width);
  info.lightmap_width = 77;  // memory that is not the structure's
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
  EXPECT_GT(info.patch_count, 0U);
  EXPECT_EQ(info.lightmap_width, 77U);

  // The address sanitizer sees where this memory ends.
  std::vector<std::uint32_t> known(info.struct_size / sizeof(std::uint32_t));
  known[0] = info.struct_size;
  auto* const as_given = reinterpret_cast<rebounce_transfer_info*>(known.data());
  ASSERT_EQ(rebounce_transfer_get_info(transfer_, as_given), REBOUNCE_OK);
  EXPECT_EQ(known[1], info.patch_count);
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

/// Bytes that `init` writes to a structure that its caller knows `size` bytes of; what is beyond
/// must stay.
template <typename Struct>
std::vector<unsigned char> bytes_of_init(void (*init)(Struct*, std::uint32_t), std::size_t size) {
  constexpr unsigned char kUntouched = 0xAB;
  alignas(Struct) std::array<unsigned char, sizeof(Struct) + 64> memory;
  memory.fill(kUntouched);
  init(reinterpret_cast<Struct*>(memory.data()), static_cast<std::uint32_t>(size));
  const auto end = memory.begin() + static_cast<std::ptrdiff_t>(size);
  EXPECT_TRUE(
      std::all_of(end, memory.end(), [](unsigned char byte) { return byte == kUntouched; }));
  return {memory.begin(), end};
}

TEST_F(FromC, InitWritesWhatTheCallersVersionOfAStructureHas) {
  const auto whole = bytes_of_init(rebounce_light_init_sized, sizeof(rebounce_light));
  auto older = bytes_of_init(rebounce_light_init_sized, sizeof(LightOfVersion1));
  EXPECT_EQ(older[0], sizeof(LightOfVersion1));
  EXPECT_TRUE(std::equal(older.begin() + 4, older.end(), whole.begin() + 4));
  bytes_of_init(rebounce_engine_settings_init_sized, sizeof(SettingsOfVersion1));
  bytes_of_init(rebounce_transfer_info_init_sized,
                offsetof(rebounce_transfer_info, lightmap_width));
  bytes_of_init(rebounce_camera_init_sized, sizeof(rebounce_camera));

  const auto later = bytes_of_init(rebounce_light_init_sized, sizeof(rebounce_light) + 8);
  EXPECT_EQ(later[0], sizeof(rebounce_light) + 8);
  EXPECT_TRUE(
      std::all_of(later.end() - 8, later.end(), [](unsigned char byte) { return byte == 0; }));

  EXPECT_EQ(bytes_of_init(rebounce_light_init_sized, 3), std::vector<unsigned char>(3, 0xAB));
  rebounce_light_init_sized(nullptr, sizeof(rebounce_light));
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

}  // namespace
}  // namespace rebounce::test_structures_from_c

#include "precompute/import/light_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/expect_error.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temporary_folder.h"

namespace rebounce::test_light_file {
namespace {

using test::json;

class LightFile : public testing::Test {
 protected:
  LightSetup read(const std::string& text) {
    test::write_bytes(folder_ / "a.json", text);
    return read_lights(folder_ / "a.json");
  }

  void expect_refused(const std::string& text, const std::string& part) {
    test::expect_error([&] { read(text); }, part);
  }

  const test::TemporaryFolder folder_;
};

TEST_F(LightFile, OfAnAssetNeedsLampsAlone) {
  test::GltfBuilder lamps;
  const json lamp{{"type", "point"}, {"intensity", 80}, {"range", 300}};
  lamps.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({lamp});
  lamps.add_node(
      {{"translation", {0, 200, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  for (const char* name : {"lamps.glb", "LAMPS.GLB"}) {
    const std::filesystem::path path = folder_ / name;
    test::write_bytes(path, lamps.glb());
    const LightSetup setup = read_lights(path, 0.01);
    ASSERT_EQ(setup.lights.size(), 1U);
    EXPECT_FLOAT_EQ(setup.lights[0].position[1], 2);
    EXPECT_FLOAT_EQ(setup.lights[0].range, 3);
    EXPECT_EQ(setup.lights[0].intensity, 80);
    EXPECT_EQ(read_lights(path).lights[0].position[1], 200);
  }
  const std::filesystem::path dark = folder_ / "dark.glb";
  test::write_bytes(dark, test::GltfBuilder::triangle().glb());
  test::expect_error([&] { read_lights(dark); }, "dark.glb has no KHR_lights_punctual lights");
}

TEST_F(LightFile, DirectionsHaveAnyLengthButZero) {
  const auto sun = [](const std::string& direction) {
    return R"({"lights": [{"type": "directional", "direction": )" + direction + "}]}";
  };
  for (const char* down : {"[0, -3, 0]", "[0, -1e20, 0]", "[0, -3e38, 0]", "[0, -1e-30, 0]"}) {
    EXPECT_EQ(read(sun(down)).lights[0].direction, (Float3{0, -1, 0})) << down;
  }
  const Float3 tilted = read(sun("[3e30, -4e30, 0]")).lights[0].direction;
  EXPECT_FLOAT_EQ(tilted[0], 0.6F);
  EXPECT_FLOAT_EQ(tilted[1], -0.8F);
  expect_refused(sun("[0, 0, 0]"), "light 0: \"direction\" must be a vector that is not zero");
}

TEST_F(LightFile, NestedWithoutEndIsRefused) {
  constexpr std::size_t kDepth = 100000;
  expect_refused(
      R"({"lights": [{"type": )" + std::string(kDepth, '[') + std::string(kDepth, ']') + "}]}",
      "a.json is nested more than 100 levels deep");
}

TEST_F(LightFile, EmittersBeyondNumbersAreRefused) {
  const std::string bright = R"({"emitters": [{"material": "a", "scale": 1e30, "color": )";
  const LightSetup setup = read(bright + "[1e6, 1, 0]}]}");
  EXPECT_FLOAT_EQ(setup.emitters[0].scale[0], 1e36F);
  expect_refused(bright + "[1, 1e9, 1]}]}", "emitter 0: \"scale\" must be finite");
}

}  // namespace
}  // namespace rebounce::test_light_file

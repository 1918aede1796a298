#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "precompute/import/import_gltf.h"
#include "tests/support/command_line.h"
#include "tests/support/unwrapped_room.h"

namespace rebounce::test_bake_command {
namespace {

using nlohmann::json;
using test::CommandLine;
using test::kLights;
using test::kScene;
using test::kUsage;

using BakeCommand = CommandLine;

TEST_F(BakeCommand, WritesASceneThatCanBeImported) {
  const std::string file = built("box.safetensors");
  const json summary =
      summary_of({"bake", file, "--lights", kLights, "--triangles", "3000", "-o", path("lit.glb")});
  EXPECT_EQ(summary["bytes"], test::read_bytes(path("lit.glb")).size());
  EXPECT_LE(summary["triangles"], 3000);
  EXPECT_GE(summary["triangles"], 1000);

  const Scene lit = import_gltf(path("lit.glb"));
  EXPECT_EQ(lit.triangle.size(), summary["triangles"].get<std::size_t>());
  ASSERT_EQ(lit.lights.size(), 1U);
  // Lit walls: not black, not blown out, and the red and green of the box's walls are there.
  double sum = 0;
  int red = 0, green = 0;
  for (const Float3& c : lit.vertex_color) {
    sum += (c[0] + c[1] + c[2]) / 3;
    red += c[0] > 2 * c[1] ? 1 : 0;
    green += c[1] > 1.5F * c[0] ? 1 : 0;
  }
  const double mean = sum / static_cast<double>(lit.vertex_color.size());
  EXPECT_GT(mean, 0.05);
  EXPECT_LT(mean, 0.7);
  EXPECT_GT(red, 20);
  EXPECT_GT(green, 20);
}

TEST_F(BakeCommand, WritesTheLightOfAnUnwrappedSceneIntoATexture) {
  const std::string scene = write("room.glb", test::unwrapped_scene(test::unwrapped_room()).glb());
  const std::string file = path("room.safetensors");
  ASSERT_EQ(
      run(test::quick({"precompute", scene, "--patches", "300", "--lightmap", "128", "-o", file}))
          .exit_code,
      test::kDone);
  const json summary =
      summary_of({"bake", file, "--lights", kLights, "--triangles", "1", "-o", path("lit.glb")});
  EXPECT_EQ(summary["texture"], json({128, 128}));
  const Scene lit = import_gltf(path("lit.glb"));
  ASSERT_EQ(lit.images.size(), 1U);
  ASSERT_EQ(lit.materials.size(), 1U);
  EXPECT_EQ(lit.materials[0].base_color_texture, 0U);
  EXPECT_EQ(lit.materials[0].base_color, (Float3{1, 1, 1}));
  for (const Float3& c : lit.vertex_color) EXPECT_EQ(c, (Float3{1, 1, 1}));
  // About half of it is charts: lit, not blown out.
  int dark = 0, white = 0;
  for (std::size_t k = 0; k < 128 * 128; ++k) {
    dark += lit.images[0].rgba[4 * k] < 8 ? 1 : 0;
    white += lit.images[0].rgba[4 * k] == 255 ? 1 : 0;
  }
  EXPECT_LT(dark, 128 * 128 * 6 / 10);
  EXPECT_LT(white, 128 * 128 / 10);
  expect_refused({"precompute", kScene, "--lightmap", "128", "-o", path("no.safetensors")},
                 "TEXCOORD_1");
}

TEST_F(BakeCommand, TakesTheExposureThatIsAskedFor) {
  const std::string file = built("box.safetensors");
  const json summary = summary_of({"bake", file, "--lights", kLights, "--triangles", "1",
                                   "--exposure", "1.5", "-o", path("lit.glb")});
  EXPECT_EQ(summary["exposure"], 1.5);
}

TEST_F(BakeCommand, RefusesWhatItCannotWriteOrRead) {
  const std::string file = built("box.safetensors");
  expect_refused({"bake", file, "--lights", kLights, "-o", path("none/lit.glb")}, "none");
  expect_refused({"bake", path("no.safetensors"), "-o", path("lit.glb")}, "no.safetensors");
  EXPECT_EQ(run({"bake", file, "-o", path("lit.obj")}).exit_code, kUsage);
}

}  // namespace
}  // namespace rebounce::test_bake_command

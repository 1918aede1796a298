#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "precompute/command_line.h"
#include "rebounce/precompute/import_gltf.h"

namespace rebounce {
namespace {

using nlohmann::json;
using test::CommandLine;
using test::kLights;
using test::kUsage;

using BakeCommand = CommandLine;

TEST_F(BakeCommand, WritesASceneThatCanBeImported) {
  const std::string file = precompute("box.safetensors");
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

TEST_F(BakeCommand, TakesTheExposureThatIsAskedFor) {
  const std::string file = precompute("box.safetensors");
  const json summary = summary_of({"bake", file, "--lights", kLights, "--triangles", "1",
                                   "--exposure", "1.5", "-o", path("lit.glb")});
  EXPECT_EQ(summary["exposure"], 1.5);
}

TEST_F(BakeCommand, RefusesWhatItCannotWriteOrRead) {
  const std::string file = precompute("box.safetensors");
  expect_refused({"bake", file, "--lights", kLights, "-o", path("none/lit.glb")}, "none");
  expect_refused({"bake", path("no.safetensors"), "-o", path("lit.glb")}, "no.safetensors");
  EXPECT_EQ(run({"bake", file, "-o", path("lit.obj")}).exit_code, kUsage);
}

}  // namespace
}  // namespace rebounce

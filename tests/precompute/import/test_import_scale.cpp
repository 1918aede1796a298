// The unit of length of a scene: what --scale changes, and the warning of an unlikely size.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "precompute/import/import_gltf.h"
#include "tests/support/expect_error.h"
#include "tests/support/gltf_builder.h"

namespace rebounce::test_import_scale {
namespace {

using test::GltfBuilder;
using test::json;

class ImportScale : public ::testing::Test {
 protected:
  Scene import(double scale = 1) { return import_gltf(triangle_.write_glb(folder_), scale); }

  std::vector<std::string> warnings_at(double node_scale) {
    triangle_.root["nodes"][0]["scale"] = {node_scale, node_scale, node_scale};
    return import().warnings;
  }

  test::TemporaryFolder folder_;
  GltfBuilder triangle_ = GltfBuilder::triangle();
};

TEST_F(ImportScale, MultipliesLengthsAndLeavesIntensities) {
  triangle_.root["nodes"][0]["translation"] = {100, 0, 0};
  const json light{{"type", "point"}, {"intensity", 80}, {"range", 300}, {"color", {1, 0.5, 0}}};
  triangle_.root["extensions"]["KHR_lights_punctual"]["lights"] = {light};
  triangle_.add_node(
      {{"translation", {0, 200, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  triangle_.add("cameras",
                {{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 1}}}});
  triangle_.add_node({{"translation", {0, 0, 50}}, {"camera", 0}});

  const Scene scene = import(0.01);
  const Float3& corner = scene.position[scene.triangle[0][1]];
  EXPECT_FLOAT_EQ(corner[0], 1.01F);
  EXPECT_FLOAT_EQ(scene.normal[0][2], 1);
  ASSERT_EQ(scene.lights.size(), 1U);
  EXPECT_FLOAT_EQ(scene.lights[0].position[1], 2);
  EXPECT_FLOAT_EQ(scene.lights[0].range, 3);
  EXPECT_EQ(scene.lights[0].intensity, 80);
  EXPECT_EQ(scene.lights[0].color, (Float3{1, 0.5F, 0}));
  ASSERT_EQ(scene.cameras.size(), 1U);
  EXPECT_FLOAT_EQ(scene.cameras[0].position[2], 0.5F);
  EXPECT_FLOAT_EQ(scene.cameras[0].vertical_fov, 0.8F);
  EXPECT_EQ(scene.cameras[0].backward, (Float3{0, 0, 1}));
}

TEST_F(ImportScale, OneIsExactlyNoScale) {
  const Scene plain = import();
  EXPECT_EQ(import(1).position, plain.position);
  EXPECT_EQ(import(2).hash, plain.hash);
}

TEST_F(ImportScale, ThatIsNoPositiveNumberIsRefused) {
  for (const double scale : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    test::expect_error([&] { import(scale); }, "is not a positive number");
  }
}

TEST_F(ImportScale, UnlikelySizesAreWarnedOf) {
  EXPECT_TRUE(warnings_at(1).empty());
  EXPECT_TRUE(warnings_at(499).empty());
  EXPECT_TRUE(warnings_at(0.21).empty());
  ASSERT_EQ(warnings_at(6500).size(), 1U);
  EXPECT_EQ(warnings_at(6500)[0], "the scene is 6500 m wide; if it is not in metres use --scale");
  ASSERT_EQ(warnings_at(0.05).size(), 1U);
  EXPECT_EQ(warnings_at(0.05)[0], "the scene is 0.05 m wide; if it is not in metres use --scale");
}

}  // namespace
}  // namespace rebounce::test_import_scale

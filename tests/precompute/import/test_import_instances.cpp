// EXT_mesh_gpu_instancing: where the instances of a mesh stand, and what is refused.

#include <gtest/gtest.h>

#include <limits>

#include "precompute/import/import_gltf.h"
#include "tests/support/expect_error.h"
#include "tests/support/gltf_builder.h"

namespace rebounce::test_import_instances {
namespace {

using test::GltfBuilder;
using test::json;

class ImportInstances : public ::testing::Test {
 protected:
  json& attributes() {
    return triangle_.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  }

  Scene import() { return import_gltf(triangle_.write_glb(folder_)); }

  void expect_refused(const std::string& named) {
    test::expect_error([&] { import(); }, named);
  }

  test::TemporaryFolder folder_;
  GltfBuilder triangle_ = GltfBuilder::triangle();
};

void expect_corner(const Scene& scene, std::size_t triangle, std::size_t corner, const Float3& at) {
  const Float3& position = scene.position[scene.triangle[triangle][corner]];
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(position[axis], at[axis], 1e-6);
}

TEST_F(ImportInstances, StandBelowTheirNodeScaledRotatedMoved) {
  triangle_.root["nodes"][0]["translation"] = {0, 0, 5};
  attributes()["TRANSLATION"] = triangle_.add_accessor<float>({0, 0, 0, 10, 20, 30}, "VEC3", 3);
  // None, and a quarter turn around z.
  attributes()["ROTATION"] =
      triangle_.add_accessor<float>({0, 0, 0, 1, 0, 0, 0.70710678F, 0.70710678F}, "VEC4", 4);
  attributes()["SCALE"] = triangle_.add_accessor<float>({1, 1, 1, 2, 3, 4}, "VEC3", 3);
  triangle_.root["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const Scene scene = import();
  ASSERT_EQ(scene.triangle.size(), 2U);
  expect_corner(scene, 0, 1, {1, 0, 5});
  expect_corner(scene, 1, 0, {10, 20, 35});
  expect_corner(scene, 1, 1, {10, 22, 35});
  expect_corner(scene, 1, 2, {7, 20, 35});
  EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(ImportInstances, RotationsMayBeNormalizedIntegers) {
  for (const bool as_bytes : {true, false}) {
    attributes()["ROTATION"] =
        as_bytes ? triangle_.add_accessor<std::int8_t>({0, 0, 127, 0}, "VEC4", 4, true)
                 : triangle_.add_accessor<std::int16_t>({0, 0, 32767, 0}, "VEC4", 4, true);
    const Scene scene = import();
    ASSERT_EQ(scene.triangle.size(), 1U);
    expect_corner(scene, 0, 1, {-1, 0, 0});
    expect_corner(scene, 0, 2, {0, -1, 0});
  }
}

TEST_F(ImportInstances, MirroredOnesKeepTheirFront) {
  attributes()["SCALE"] = triangle_.add_accessor<float>({-1, 1, 1}, "VEC3", 3);
  const Scene scene = import();
  expect_corner(scene, 0, 1, {0, 1, 0});
  expect_corner(scene, 0, 2, {-1, 0, 0});
}

TEST_F(ImportInstances, DoNotMoveTheNodesChildren) {
  triangle_.root["nodes"][0]["children"] = {1};
  triangle_.add_node({{"mesh", 0}});
  attributes()["TRANSLATION"] = triangle_.add_accessor<float>({7, 0, 0, 8, 0, 0}, "VEC3", 3);
  const Scene scene = import();
  ASSERT_EQ(scene.triangle.size(), 3U);
  expect_corner(scene, 2, 0, {0, 0, 0});
}

TEST_F(ImportInstances, NoneAndOtherAttributesAreOneInPlace) {
  attributes() = {{"_ID", triangle_.add_accessor<float>({1, 2, 3}, "SCALAR", 1)}};
  EXPECT_EQ(import().triangle.size(), 1U);
}

TEST_F(ImportInstances, OfDifferentNumberAreRefused) {
  attributes()["TRANSLATION"] = triangle_.add_accessor<float>({0, 0, 0, 1, 1, 1}, "VEC3", 3);
  attributes()["SCALE"] = triangle_.add_accessor<float>({1, 1, 1}, "VEC3", 3);
  expect_refused("nodes[0] (EXT_mesh_gpu_instancing): its attributes have 2 and 1 elements");
}

TEST_F(ImportInstances, OfAnotherTypeAreRefused) {
  attributes()["ROTATION"] = triangle_.add_accessor<float>({0, 0, 0}, "VEC3", 3);
  expect_refused("nodes[0] (EXT_mesh_gpu_instancing): ROTATION has 3 components instead of 4");
  attributes()["ROTATION"] = 99;
  expect_refused("EXT_mesh_gpu_instancing.attributes.ROTATION is 99");
  triangle_.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = json::object();
  expect_refused("EXT_mesh_gpu_instancing.attributes is missing");
}

TEST_F(ImportInstances, WithoutAFinitePlaceAreRefused) {
  attributes()["TRANSLATION"] =
      triangle_.add_accessor<float>({0, std::numeric_limits<float>::infinity(), 0}, "VEC3", 3);
  expect_refused("no finite position");
}

/// A few bytes may claim millions of instances.
TEST_F(ImportInstances, ThatFillTheMemoryAreRefused) {
  const int claim = triangle_.add(
      "accessors", {{"componentType", test::kFloat}, {"count", 1 << 20}, {"type", "VEC3"}});
  attributes()["TRANSLATION"] = claim;
  for (int i = 0; i < 70; ++i) triangle_.add_node(triangle_.root["nodes"][0]);
  expect_refused("more than 67108864 triangles");
}

}  // namespace
}  // namespace rebounce::test_import_instances

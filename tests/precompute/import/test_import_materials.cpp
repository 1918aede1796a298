// What the importer makes of materials and of the colours of vertices.

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "precompute/patches/texture_sampling.h"
#include "tests/precompute/import/imported_triangle.h"

namespace rebounce::test_import_materials {
namespace {

using test::expect_near;
using test::json;
using ImportMaterials = test::ImportedTriangle;

TEST_F(ImportMaterials, VertexColoursAreLinear) {
  triangle_.primitive()["attributes"]["COLOR_0"] = triangle_.add_accessor<std::uint8_t>(
      {255, 0, 51, 9, 0, 255, 51, 9, 51, 51, 255, 9}, "VEC4", 4, true);
  const Scene scene = import(triangle_);
  expect_near(scene.vertex_color[0], {1, 0, 0.2F});
  expect_near(scene.vertex_color[2], {0.2F, 0.2F, 1});
  expect_near(
      mean_base_color(scene, scene.materials[0], {},
                      {scene.vertex_color[0], scene.vertex_color[1], scene.vertex_color[2]}),
      {0.4F, 0.4F, 1.4F / 3});
}

TEST_F(ImportMaterials, SpecularGlossinessGivesItsDiffuseColour) {
  triangle_.add(
      "materials",
      {{"extensions",
        {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {0.25, 0.5, 1, 1}}}}}}});
  triangle_.primitive()["material"] = 0;
  EXPECT_EQ(import(triangle_).materials[0].base_color, (Float3{0.25F, 0.5F, 1}));
}

TEST_F(ImportMaterials, EmissionIsInNits) {
  triangle_.add("materials",
                {{"name", "Lamp"},
                 {"doubleSided", true},
                 {"emissiveFactor", {1, 0.5, 0.25}},
                 {"extensions",
                  {{"KHR_materials_emissive_strength", {{"emissiveStrength", 3000000000ULL}}}}}});
  triangle_.primitive()["material"] = 0;
  Scene scene = import(triangle_);
  ASSERT_EQ(scene.materials.size(), 1U);
  EXPECT_EQ(scene.materials[0].name, "Lamp");
  EXPECT_TRUE(scene.materials[0].double_sided);
  EXPECT_EQ(scene.materials[0].emitted_luminance, (Float3{3e9F, 1.5e9F, 0.75e9F}));
  triangle_.root["materials"][0]["extensions"]["KHR_materials_unlit"] = json::object();
  scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].emitted_luminance, (Float3{0, 0, 0}));
  ASSERT_EQ(scene.warnings.size(), 2U);
  EXPECT_NE(scene.warnings[0].find("emission of 1 unlit"), std::string::npos);
}

TEST_F(ImportMaterials, NegativeFactorsAreClampedWithAWarning) {
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {-1, 0.5, 2, 1}}}}});
  triangle_.primitive()["material"] = 0;
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].base_color, (Float3{0, 0.5F, 2}));
  EXPECT_EQ(scene.warnings.size(), 1U);
}

TEST_F(ImportMaterials, AlphaAndTransmissionAreTaken) {
  triangle_.add("materials", {{"alphaMode", "MASK"},
                              {"alphaCutoff", 0.25},
                              {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.75}}}}});
  triangle_.add("materials",
                {{"alphaMode", "BLEND"},
                 {"extensions",
                  {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {1, 1, 1, 0.5}}}}}}});
  triangle_.add("materials",
                {{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.9}}}}}});
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 7}}}},
                              {"alphaCutoff", -1},
                              {"extensions", {{"KHR_materials_transmission", json::object()}}}});
  const Scene scene = import(triangle_);
  const Material& mask = scene.materials[0];
  EXPECT_EQ(mask.alpha_mode, AlphaMode::kMask);
  EXPECT_EQ(mask.alpha_cutoff, 0.25F);
  EXPECT_EQ(mask.base_alpha, 0.75F);
  EXPECT_EQ(mask.transmission, 0);
  EXPECT_EQ(scene.materials[1].alpha_mode, AlphaMode::kBlend);
  EXPECT_EQ(scene.materials[1].alpha_cutoff, 0.5F);
  EXPECT_EQ(scene.materials[1].base_alpha, 0.5F);
  EXPECT_EQ(scene.materials[2].alpha_mode, AlphaMode::kOpaque);
  EXPECT_EQ(scene.materials[2].transmission, 0.9F);
  EXPECT_EQ(scene.materials[3].base_alpha, 1);
  EXPECT_EQ(scene.materials[3].alpha_cutoff, 0);
  EXPECT_EQ(scene.materials[3].transmission, 0);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(ImportMaterials, WhatIsSimplifiedOfTransmissionIsCounted) {
  const json glass = {{"transmissionFactor", 0.9}};
  triangle_.add("materials", {{"emissiveFactor", {1, 1, 1}},
                              {"extensions", {{"KHR_materials_transmission", glass}}}});
  triangle_.add("materials",
                {{"extensions", {{"KHR_materials_diffuse_transmission", json::object()}}}});
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.warnings.size(), 2U);
  EXPECT_TRUE(scene.warnings[0].starts_with("1 materials that emit and transmit"));
  EXPECT_TRUE(scene.warnings[1].starts_with("1 materials that transmit light diffusely"));
}

TEST_F(ImportMaterials, UnlitMaterialsAreLitLikeOthers) {
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.25, 0.5, 1, 1}}}},
                              {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  triangle_.primitive()["material"] = 0;
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].base_color, (Float3{0.25F, 0.5F, 1}));
  EXPECT_EQ(scene.materials[0].emitted_luminance, (Float3{0, 0, 0}));
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_EQ(scene.warnings[0], "1 unlit materials are lit like all others");
}

TEST_F(ImportMaterials, AlphaOfVertexColoursIsIgnoredWithAWarningWhereItWouldCount) {
  triangle_.primitive()["attributes"]["COLOR_0"] =
      triangle_.add_accessor<float>({1, 1, 1, 1, 1, 1, 1, 0.5, 1, 1, 1, 1}, "VEC4", 4);
  triangle_.add("materials", {{"alphaMode", "OPAQUE"}});
  triangle_.primitive()["material"] = 0;
  EXPECT_TRUE(import(triangle_).warnings.empty());
  triangle_.root["materials"][0]["alphaMode"] = "MASK";
  const auto warnings = import(triangle_).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("alpha of the vertex colours"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace rebounce::test_import_materials

// What the importer makes of textures, and how they are averaged.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "precompute/patches/texture_sampling.h"
#include "tests/precompute/import/imported_triangle.h"
#include "tests/support/expect_error.h"

namespace rebounce::test_import_textures {
namespace {

using test::expect_near;
using test::ImportedTriangle;
using test::json;
using test::kOneTexelPng;

// A PNG of 2 x 1 pixels: black, then (188, 188, 188).
const std::vector<std::uint8_t> kTwoTexelPng{
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
    0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x08, 0x02, 0x00, 0x00, 0x00, 0x7b,
    0x40, 0xe8, 0xdd, 0x00, 0x00, 0x00, 0x0f, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60,
    0x60, 0x60, 0xd8, 0xb3, 0x67, 0x0f, 0x00, 0x04, 0x6f, 0x02, 0x35, 0x7b, 0xa1, 0xda, 0x87,
    0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

/// A triangle with one texture: black on the left, mid-grey (sRGB 188, linear 0.5029) on the right.
class TexturedTriangle : public ImportedTriangle {
 protected:
  TexturedTriangle() {
    triangle_.primitive()["attributes"]["TEXCOORD_0"] =
        triangle_.add_accessor<float>({0, 0, 1, 0, 0, 1}, "VEC2", 2);
    triangle_.primitive()["attributes"]["TEXCOORD_1"] = triangle_.add_accessor<std::uint8_t>(
        {0, 0, 0, 0, 0, 255, 0, 0, 255, 255, 0, 0}, "VEC2", 2, true);
    // Two bytes of padding after each pair.
    triangle_.root["accessors"].back()["count"] = 3;
    triangle_.root["bufferViews"].back()["byteStride"] = 4;
    triangle_.add("images",
                  {{"bufferView", triangle_.add_view(kTwoTexelPng)}, {"mimeType", "image/png"}});
    triangle_.add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}});
    triangle_.add("textures", {{"source", 0}, {"sampler", 0}});
    triangle_.add("materials",
                  {{"pbrMetallicRoughness",
                    {{"baseColorFactor", {1, 0.5, 0, 1}}, {"baseColorTexture", {{"index", 0}}}}}});
    triangle_.primitive()["material"] = 0;
  }

  json& base_color_texture() {
    return triangle_.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  }
};

constexpr float kGrey = 0.5029F;

TEST_F(TexturedTriangle, TextureIsKeptEncodedAndDecoded) {
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.textures.size(), 1U);
  ASSERT_EQ(scene.images.size(), 1U);
  EXPECT_EQ(scene.textures[0].encoded[1], 'P');
  EXPECT_EQ(scene.textures[0].wrap_s, TextureWrap::kClampToEdge);
  EXPECT_EQ(scene.textures[0].wrap_t, TextureWrap::kMirroredRepeat);
  EXPECT_EQ(scene.images[0].width, 2);
  EXPECT_EQ(scene.images[0].rgba, (std::vector<std::uint8_t>{0, 0, 0, 255, 188, 188, 188, 255}));
  EXPECT_EQ(scene.materials[0].base_color_texture, 0U);
}

TEST_F(TexturedTriangle, ReflectanceIsAveragedInLinearLight) {
  const Scene scene = import(triangle_);
  // Across the whole width at constant v the two texels count alike: the mean of their linear
  // values, not the linear value of their mean.
  const Float3 mean = mean_base_color(scene, scene.materials[0], {{{0, 0}, {1, 0}, {0.5F, 0}}},
                                      {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}});
  expect_near(mean, {kGrey / 2, kGrey / 4, 0}, 0.01);
  const Float3 right = mean_base_color(scene, scene.materials[0], {{{1, 0}, {0.8F, 0}, {0.9F, 1}}},
                                       {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}});
  expect_near(right, {kGrey, kGrey / 2, 0}, 1e-3);
}

TEST_F(TexturedTriangle, TexcoordSetIsChosen) {
  for (const int set : {0, 1}) {
    base_color_texture()["texCoord"] = set;
    const auto texcoord = import(triangle_).base_color_texcoord;
    const std::vector<Float2> first{{0, 0}, {1, 0}, {0, 1}};
    const std::vector<Float2> second{{0, 0}, {0, 1}, {1, 1}};
    EXPECT_EQ(texcoord, set == 0 ? first : second);
  }
}

TEST_F(TexturedTriangle, TextureTransformIsScaleThenRotationThenOffset) {
  base_color_texture()["extensions"]["KHR_texture_transform"] = {{"offset", {0.25, 1}},
                                                                 {"scale", {2, 4}},
                                                                 {"rotation", std::numbers::pi / 2},
                                                                 {"texCoord", 0}};
  base_color_texture()["texCoord"] = 7;
  const Scene scene = import(triangle_);
  // (u, v) -> (4 v + 0.25, -2 u + 1): counter-clockwise as seen with v pointing down.
  const std::array<Float2, 3> expected{{{0.25F, 1}, {0.25F, -1}, {4.25F, 1}}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(scene.base_color_texcoord[i][0], expected[i][0], 1e-6);
    EXPECT_NEAR(scene.base_color_texcoord[i][1], expected[i][1], 1e-6);
  }
}

TEST_F(TexturedTriangle, EmissiveTextureMultipliesTheLuminance) {
  triangle_.root["materials"][0] = {
      {"emissiveFactor", {1, 1, 1}},
      {"emissiveTexture", {{"index", 0}}},
      {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 100}}}}}};
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].emissive_texture, 0U);
  const Float3 bright =
      mean_emitted_luminance(scene, scene.materials[0], {{{0.8F, 0}, {1, 0}, {0.9F, 1}}}, {});
  expect_near(bright, {100 * kGrey, 100 * kGrey, 100 * kGrey}, 0.1);
}

TEST_F(TexturedTriangle, SameImageAndWrapIsOneTexture) {
  triangle_.add("textures", {{"source", 0}, {"sampler", 0}});
  triangle_.add("textures", {{"source", 0}});
  for (const int index : {1, 2}) {
    triangle_.add("materials",
                  {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", index}}}}}});
  }
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.textures.size(), 2U);
  EXPECT_EQ(scene.materials[1].base_color_texture, 0U);
  EXPECT_EQ(scene.materials[2].base_color_texture, 1U);
}

// Big-endian, over the four bytes from `offset`.
std::vector<std::uint8_t> with_number(std::vector<std::uint8_t> bytes, std::size_t offset,
                                      std::uint32_t number) {
  for (std::size_t k = 0; k < 4; ++k) {
    bytes[offset + k] = static_cast<std::uint8_t>(number >> (24 - 8 * k));
  }
  return bytes;
}

TEST_F(TexturedTriangle, ImageOfMorePixelsThanItsBytesCanHoldIsDamaged) {
  constexpr std::size_t kChunkType = 12, kWidth = 16;
  for (const auto& png : {with_number(kTwoTexelPng, kWidth, 10'000'000),
                          with_number(kTwoTexelPng, kChunkType, 0x43674249)}) {  // no header first
    triangle_.root["images"][0] = {{"bufferView", triangle_.add_view(png)}};
    const Scene scene = import(triangle_);
    EXPECT_EQ(scene.materials[0].base_color_texture, kNone);
    ASSERT_EQ(scene.warnings.size(), 1U);
  }
}

TEST_F(TexturedTriangle, ImageOfMoreThanAGibibyteIsRefused) {
  const auto png = with_number(kTwoTexelPng, 16, 400'000'000);
  triangle_.root["images"][0] = {{"bufferView", triangle_.add_view(png)}};
  test::expect_error([&] { import(triangle_); }, "400000000 x 1 pixels is too large");
}

TEST_F(TexturedTriangle, MissingOrDamagedImageIsWhiteWithAWarning) {
  const std::string text = "not a picture at all";
  const int view = triangle_.add_view(std::vector<char>(text.begin(), text.end()));
  for (const json& image : {json{{"uri", "absent%20picture.png"}}, json{{"bufferView", view}},
                            json::object(), json{{"uri", "data:image/png;base64,AAAA"}}}) {
    triangle_.root["images"][0] = image;
    const Scene scene = import(triangle_);
    EXPECT_EQ(scene.materials[0].base_color_texture, kNone);
    EXPECT_EQ(scene.materials[0].base_color, (Float3{1, 0.5F, 0}));
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_NE(scene.warnings[0].find("images[0]"), std::string::npos) << scene.warnings[0];
  }
}

TEST_F(TexturedTriangle, TransmissionIsTheMeanOfItsTextureWhereThatCanBeRead) {
  triangle_.root["materials"][0] = {
      {"extensions",
       {{"KHR_materials_transmission",
         {{"transmissionFactor", 0.5}, {"transmissionTexture", {{"index", 0}}}}}}}};
  Scene scene = import(triangle_);
  EXPECT_FLOAT_EQ(scene.materials[0].transmission, 0.5F * 94 / 255);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_TRUE(scene.warnings[0].ends_with("are taken for their mean")) << scene.warnings[0];
  triangle_.root["images"][0] = {{"uri", "absent.png"}};
  scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].transmission, 0.5F);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("cannot be read"), std::string::npos) << scene.warnings[0];
}

TEST_F(TexturedTriangle, ImageBesideTheFileMayHaveSpacesInItsName) {
  test::write_bytes(folder_.path() / "a picture.png",
                    std::string(kOneTexelPng.begin(), kOneTexelPng.end()));
  for (const char* uri : {"a%20picture.png", "a picture.png", "./a%20picture.png"}) {
    triangle_.root["images"][0] = {{"uri", uri}};
    const Scene scene = import(triangle_);
    ASSERT_EQ(scene.images.size(), 1U);
    EXPECT_EQ(scene.images[0].rgba, (std::vector<std::uint8_t>{1, 2, 3, 255}));
  }
}

TEST(TextureSampling, SrgbFollowsIec61966) {
  EXPECT_EQ(srgb_to_linear(0), 0);
  EXPECT_EQ(srgb_to_linear(255), 1);
  EXPECT_NEAR(srgb_to_linear(188), kGrey, 1e-4);
  EXPECT_NEAR(srgb_to_linear(10), 10 / 255.0 / 12.92, 1e-7);
}

TEST(TextureSampling, WrapsAsTheSamplerSays) {
  const Image image{2, 1, {0, 0, 0, 255, 255, 255, 255, 255}};
  const auto at = [&](TextureWrap wrap, float u) {
    return sample_texture({{}, wrap, wrap}, image, {u, 0.5F})[0];
  };
  for (const auto wrap :
       {TextureWrap::kRepeat, TextureWrap::kClampToEdge, TextureWrap::kMirroredRepeat}) {
    EXPECT_FLOAT_EQ(at(wrap, 0.25F), 0);
    EXPECT_FLOAT_EQ(at(wrap, 0.5F), 0.5F);
    EXPECT_FLOAT_EQ(at(wrap, 0.75F), 1);
    for (const float wild : {1e30F, -1e30F, std::nanf(""), INFINITY}) {
      EXPECT_GE(at(wrap, wild), 0);
      EXPECT_LE(at(wrap, wild), 1);
    }
  }
  EXPECT_FLOAT_EQ(at(TextureWrap::kRepeat, 1.25F), 0);
  EXPECT_FLOAT_EQ(at(TextureWrap::kRepeat, -0.25F), 1);
  EXPECT_FLOAT_EQ(at(TextureWrap::kRepeat, 0), 0.5F);
  EXPECT_FLOAT_EQ(at(TextureWrap::kMirroredRepeat, 1.25F), 1);
  EXPECT_FLOAT_EQ(at(TextureWrap::kMirroredRepeat, -0.25F), 0);
  EXPECT_FLOAT_EQ(at(TextureWrap::kMirroredRepeat, 0), 0);
  EXPECT_FLOAT_EQ(at(TextureWrap::kClampToEdge, 1.25F), 1);
  EXPECT_FLOAT_EQ(at(TextureWrap::kClampToEdge, -0.25F), 0);
}

TEST(TextureSampling, BusyTextureIsAveragedWithoutAliasing) {
  // A checkerboard repeated as often as there are sample parts along a side.
  Scene scene;
  scene.images.push_back(
      {2, 2, {0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 255}});
  scene.textures.push_back({});
  Material material;
  material.base_color_texture = 0;
  for (const float repeats : {16.0F, 32.0F, 64.0F, 1000.0F}) {
    const Float3 mean = mean_base_color(scene, material, {{{0, 0}, {repeats, 0}, {0, repeats}}},
                                        {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}});
    EXPECT_NEAR(mean[0], 0.5, 0.03) << repeats;
  }
}

}  // namespace
}  // namespace rebounce::test_import_textures

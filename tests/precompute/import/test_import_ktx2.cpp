// KHR_texture_basisu: KTX2 images are not read; what a material is without them, and the warnings.

#include "tests/precompute/import/imported_triangle.h"

namespace rebounce::test_import_ktx2 {
namespace {

using test::GltfBuilder;
using test::json;

/// The header of a KTX2 file of 4 x 4 pixels, block-compressed as Basis Universal, without levels.
std::vector<std::uint8_t> ktx2() {
  std::vector<std::uint8_t> bytes = {0xAB, 'K',  'T',  'X',  ' ',  '2',
                                     '0',  0xBB, '\r', '\n', 0x1A, '\n'};
  // Format, size of its units, width, height, depth, layers, faces, levels, supercompression.
  for (const std::uint32_t field : {0U, 1U, 4U, 4U, 0U, 0U, 1U, 1U, 1U}) {
    for (int k = 0; k < 4; ++k) bytes.push_back(static_cast<std::uint8_t>(field >> (8 * k)));
  }
  bytes.resize(80);
  return bytes;
}

/// A triangle whose texture 0 has a KTX2 image alone.
class ImportKtx2 : public test::ImportedTriangle {
 protected:
  ImportKtx2() {
    triangle_.primitive()["attributes"]["TEXCOORD_0"] =
        triangle_.add_accessor<float>({0, 0, 1, 0, 0, 1}, "VEC2", 2);
    triangle_.add("images",
                  {{"bufferView", triangle_.add_view(ktx2())}, {"mimeType", "image/ktx2"}});
    triangle_.add("textures", {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}});
    triangle_.primitive()["material"] = 0;
    triangle_.root["extensionsRequired"] = {"KHR_texture_basisu"};
  }

  /// The only warning of `scene`.
  static std::string warning(const Scene& scene) {
    EXPECT_EQ(scene.warnings.size(), 1U);
    return scene.warnings.empty() ? "" : scene.warnings[0];
  }

  const json kTexture = {{"index", 0}};
};

TEST_F(ImportKtx2, ColourIsTheFactorAlone) {
  triangle_.add("materials",
                {{"pbrMetallicRoughness",
                  {{"baseColorFactor", {0.5, 0.25, 0.125, 1}}, {"baseColorTexture", kTexture}}}});
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", kTexture}}}});
  const Scene scene = import(triangle_);
  EXPECT_TRUE(scene.textures.empty());
  EXPECT_EQ(scene.materials[0].base_color_texture, kNone);
  test::expect_near(scene.materials[0].base_color, {0.5F, 0.25F, 0.125F});
  EXPECT_TRUE(warning(scene).starts_with("2 materials have colours in KTX2 images"))
      << scene.warnings[0];
}

TEST_F(ImportKtx2, AnImageThatIsReadIsTakenInstead) {
  triangle_.add("images", {{"bufferView", triangle_.add_view(test::kOneTexelPng)}});
  triangle_.root["textures"][0]["source"] = 1;
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", kTexture}}}});
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.images.size(), 1U);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(ImportKtx2, NothingShinesWhereTheTextureWouldSayWhat) {
  triangle_.add("materials", {{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", kTexture}});
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].emitted_luminance, (Float3{0, 0, 0}));
  EXPECT_TRUE(warning(scene).starts_with("1 materials have emission in KTX2 images"))
      << scene.warnings[0];
}

TEST_F(ImportKtx2, TransmissionIsTheFactorAlone) {
  triangle_.add("materials",
                {{"extensions",
                  {{"KHR_materials_transmission",
                    {{"transmissionFactor", 0.5}, {"transmissionTexture", kTexture}}}}}});
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].transmission, 0.5F);
  EXPECT_TRUE(warning(scene).starts_with("1 materials have transmission in KTX2 images"))
      << scene.warnings[0];
}

}  // namespace
}  // namespace rebounce::test_import_ktx2

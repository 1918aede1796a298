// EXT_texture_webp: decoded, kept as PNG for the runtime, with and without a fallback.

#include <gtest/gtest.h>
#include <webp/encode.h>

#include "precompute/import/import_gltf.h"
#include "tests/support/expect_error.h"
#include "tests/support/gltf_builder.h"

namespace rebounce::test_import_webp {
namespace {

using test::GltfBuilder;
using test::json;

// Two pixels: opaque red, half-transparent blue.
const std::vector<std::uint8_t> kPixels{255, 0, 0, 255, 0, 0, 255, 128};

// WebP, without loss, of a picture one pixel high.
std::vector<std::uint8_t> webp(const std::vector<std::uint8_t>& rgba) {
  const int width = static_cast<int>(rgba.size()) / 4;
  std::uint8_t* encoded = nullptr;
  const std::size_t size =
      WebPEncodeLosslessRGBA(rgba.data(), width, 1, static_cast<int>(rgba.size()), &encoded);
  std::vector<std::uint8_t> bytes(encoded, encoded + size);
  WebPFree(encoded);
  return bytes;
}

/// A triangle whose texture's WebP image is image 0.
class ImportWebp : public ::testing::Test {
 protected:
  void set_image(const std::vector<std::uint8_t>& encoded) {
    triangle_.add("images",
                  {{"bufferView", triangle_.add_view(encoded)}, {"mimeType", "image/webp"}});
  }

  ImportWebp() {
    triangle_.primitive()["attributes"]["TEXCOORD_0"] =
        triangle_.add_accessor<float>({0, 0, 1, 0, 0, 1}, "VEC2", 2);
    triangle_.add("textures", {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}});
    triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    triangle_.primitive()["material"] = 0;
    triangle_.root["extensionsRequired"] = {"EXT_texture_webp"};
  }

  Scene import() { return import_gltf(triangle_.write_glb(folder_)); }

  test::TemporaryFolder folder_;
  GltfBuilder triangle_ = GltfBuilder::triangle();
};

TEST_F(ImportWebp, IsDecodedAndKeptAsPng) {
  set_image(webp(kPixels));
  const Scene scene = import();
  EXPECT_TRUE(scene.warnings.empty());
  ASSERT_EQ(scene.images.size(), 1U);
  EXPECT_EQ(scene.images[0].width, 2);
  EXPECT_EQ(scene.images[0].height, 1);
  EXPECT_EQ(scene.images[0].rgba, kPixels);

  // What is kept decodes to the same picture without the extension.
  GltfBuilder again = GltfBuilder::triangle();
  again.add("images", {{"bufferView", again.add_view(scene.textures[0].encoded)}});
  again.add("textures", {{"source", 0}});
  again.root["materials"] = triangle_.root["materials"];
  again.primitive()["material"] = 0;
  EXPECT_EQ(scene.textures[0].encoded[1], 'P');
  EXPECT_EQ(import_gltf(again.write_glb(folder_)).images.at(0).rgba, kPixels);
}

TEST_F(ImportWebp, IsPreferredToItsFallback) {
  set_image(webp(kPixels));
  set_image(webp({1, 2, 3, 255}));
  triangle_.root["textures"][0]["source"] = 1;
  EXPECT_EQ(import().images.at(0).rgba, kPixels);
}

TEST_F(ImportWebp, FallsBackWhereItCannotBeDecoded) {
  auto damaged = webp(kPixels);
  damaged.resize(damaged.size() / 2);
  set_image(damaged);
  set_image(webp({1, 2, 3, 255}));
  triangle_.root["textures"][0]["source"] = 1;
  const Scene scene = import();
  EXPECT_EQ(scene.images.at(0).rgba, (std::vector<std::uint8_t>{1, 2, 3, 255}));
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("fallback"), std::string::npos) << scene.warnings[0];
}

TEST_F(ImportWebp, IsWhiteWhereNothingCanBeDecoded) {
  set_image({'R', 'I', 'F', 'F', 4, 0, 0, 0, 'W', 'E', 'B', 'P'});
  const Scene scene = import();
  EXPECT_TRUE(scene.textures.empty());
  EXPECT_EQ(scene.materials[0].base_color_texture, kNone);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("white"), std::string::npos) << scene.warnings[0];
}

TEST_F(ImportWebp, ImagesThatDoNotExistAreRefused) {
  set_image(webp(kPixels));
  triangle_.root["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 4;
  test::expect_error([&] { import(); }, "textures[0].extensions.EXT_texture_webp.source is 4");
  triangle_.root["textures"][0]["extensions"]["EXT_texture_webp"] = json::object();
  test::expect_error([&] { import(); }, "EXT_texture_webp.source is missing");
}

TEST_F(ImportWebp, NoDamagedByteCrashes) {
  std::vector<std::uint8_t> noise(4 * 64);
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<std::uint8_t>(i * 97 % 251);
  const auto whole = webp(noise);
  int decoded = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto damaged = whole;
    damaged[i] ^= 0xFF;
    triangle_.root.erase("images");
    set_image(damaged);
    decoded += import().images.empty() ? 0 : 1;
  }
  EXPECT_LT(decoded, static_cast<int>(whole.size()));
}

}  // namespace
}  // namespace rebounce::test_import_webp

// How much of the light a surface stops, from its alpha.

#include <gtest/gtest.h>

#include "precompute/patches/texture_sampling.h"
#include "tests/support/test_scenes.h"
#include "transfer/data/opacity_maps.h"

namespace rebounce::test_opacity {
namespace {

/// A material over a texture of 2 x 1 pixels: alpha 51 (0.2) on the left, 255 on the right.
class Opacity : public ::testing::Test {
 protected:
  Opacity() {
    scene_.textures.push_back({{}, TextureWrap::kClampToEdge, TextureWrap::kClampToEdge});
    scene_.images.push_back({2, 1, {10, 20, 30, 51, 40, 50, 60, 255}});
    material().base_color_texture = 0;
  }

  Material& material() { return scene_.materials[0]; }
  float at(float u) const { return opacity_at(scene_, scene_.materials[0], {u, 0.5F}); }
  float mean(const std::array<Float2, 3>& texcoord) const {
    return mean_opacity(scene_, scene_.materials[0], texcoord);
  }

  Scene scene_ = test::empty_scene();
};

constexpr std::array<Float2, 3> kLeftTexel{{{0.1F, 0.2F}, {0.2F, 0.3F}, {0.1F, 0.8F}}};
// The lower half of a square over the whole picture.
constexpr std::array<Float2, 3> kLowerHalf{{{0, 0}, {1, 0}, {0, 1}}};

TEST_F(Opacity, OpaqueMaterialsIgnoreAlpha) {
  material().base_alpha = 0.25F;
  EXPECT_EQ(at(0), 1);
  EXPECT_EQ(mean(kLowerHalf), 1);
}

TEST_F(Opacity, BlendingIsTextureTimesFactor) {
  material().alpha_mode = AlphaMode::kBlend;
  material().base_alpha = 0.5F;
  EXPECT_FLOAT_EQ(at(0), 0.1F);
  EXPECT_FLOAT_EQ(at(1), 0.5F);
  EXPECT_FLOAT_EQ(at(0.5F), 0.3F);
  EXPECT_FLOAT_EQ(mean(kLeftTexel), 0.1F);
}

TEST_F(Opacity, MasksAreThereFromTheCutoffOn) {
  material().alpha_mode = AlphaMode::kMask;
  material().alpha_cutoff = 0.6F;
  EXPECT_EQ(at(0), 0);
  EXPECT_EQ(at(0.49F), 0);
  EXPECT_EQ(at(0.51F), 1);
  EXPECT_EQ(at(1), 1);
  material().alpha_cutoff = 0;
  EXPECT_EQ(at(0), 1);
  material().alpha_cutoff = 1.5F;
  EXPECT_EQ(at(1), 0);
}

TEST_F(Opacity, MeanOfAMaskIsItsArea) {
  // Of the triangle u + v < 1 a quarter has u > 1/2.
  material().alpha_mode = AlphaMode::kMask;
  material().alpha_cutoff = 0.6F;
  EXPECT_NEAR(mean(kLowerHalf), 0.25F, 0.07);
  EXPECT_EQ(mean(kLeftTexel), 0);
}

TEST_F(Opacity, MeanOfABlendIsItsIntegral) {
  // With w = 1 - u, alpha is 1 for w < 1/4, 1.4 - 1.6 w up to w = 3/4 and 0.2 beyond. Its integral
  // times the density 2 w is 1/16 + 4/15 + 7/80 = 5/12; there are 16 samples.
  material().alpha_mode = AlphaMode::kBlend;
  EXPECT_NEAR(mean(kLowerHalf), 5.0 / 12, 0.02);
}

TEST_F(Opacity, WithoutATextureTheFactorDecides) {
  material().base_color_texture = kNone;
  material().base_alpha = 0.4F;
  material().alpha_mode = AlphaMode::kBlend;
  EXPECT_FLOAT_EQ(mean(kLowerHalf), 0.4F);
  material().alpha_mode = AlphaMode::kMask;
  EXPECT_EQ(mean(kLowerHalf), 0);
}

}  // namespace
}  // namespace rebounce::test_opacity

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <string>

#include "rebounce/error.h"
#include "runtime/demo/image/image_file.h"
#include "runtime/demo/picture/camera.h"
#include "runtime/demo/picture/picture.h"
#include "runtime/images/coded_image.h"
#include "tests/support/rectangle_scene.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_picture {
namespace {

using test::floor_corners;
using test::SceneBuilder;

constexpr float kPi = std::numbers::pi_v<float>;

// Nine pixels over about 2 cm of floor around `target`, seen from above.
PictureSettings close_up(const Float3& target, Show show) {
  PictureSettings settings;
  settings.width = settings.height = 3;
  settings.camera = look_at({target[0], 0.5F, target[2]}, target, 0.02F);
  settings.show = show;
  return settings;
}

Picture render(TransferData& data, const PictureLight& light, const PictureSettings& settings) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  return render_picture(data, tracer, light, settings);
}

// A closed room of side 2 around (0, 1, 0) with a square lamp below the ceiling.
SceneBuilder lamp_room() {
  SceneBuilder scene;
  const std::uint32_t white = scene.add_material({0.75F, 0.75F, 0.75F});
  const std::uint32_t red = scene.add_material({0.6F, 0.05F, 0.05F});
  const std::uint32_t green = scene.add_material({0.1F, 0.5F, 0.1F});
  const std::uint32_t lamp = scene.add_material({0.5F, 0.5F, 0.5F}, {20, 18, 12});
  scene.add_rectangle(floor_corners(1), white);
  scene.add_rectangle({{{-1, 2, -1}, {1, 2, -1}, {1, 2, 1}, {-1, 2, 1}}}, white);
  scene.add_rectangle({{{-1, 0, -1}, {1, 0, -1}, {1, 2, -1}, {-1, 2, -1}}}, white);
  scene.add_rectangle({{{-1, 0, 1}, {-1, 0, -1}, {-1, 2, -1}, {-1, 2, 1}}}, red);
  scene.add_rectangle({{{1, 0, -1}, {1, 0, 1}, {1, 2, 1}, {1, 2, -1}}}, green);
  scene.add_rectangle({{{1, 0, 1}, {-1, 0, 1}, {-1, 2, 1}, {1, 2, 1}}}, white);
  scene.add_rectangle(
      {{{-0.3F, 1.98F, -0.3F}, {0.3F, 1.98F, -0.3F}, {0.3F, 1.98F, 0.3F}, {-0.3F, 1.98F, 0.3F}}},
      lamp);
  scene.add_rectangle(
      {{{-0.5F, 0.6F, 0.1F}, {0.2F, 0.6F, 0.1F}, {0.2F, 0.6F, -0.6F}, {-0.5F, 0.6F, -0.6F}}},
      white);
  return scene;
}

TEST(Picture, UniformIrradianceShowsAlbedoTimesIrradianceOverPi) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(5), scene.add_material({0.5F, 0.25F, 1}));
  const std::vector<Float3> indirect{{100, 200, 50}};
  const Picture picture =
      render(scene.data(), {.indirect_irradiance = indirect}, close_up({0, 0, 0}, Show::kIndirect));
  ASSERT_EQ(picture.pixel.size(), 9U);
  for (const Float3& pixel : picture.pixel) {
    for (const float channel : pixel) EXPECT_NEAR(channel, 50 / kPi, 2e-4F);
  }
}

TEST(Picture, FirstFlightIsTakenOutOfTheInterpolatedLight) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(5), scene.add_material({1, 1, 1}));
  const std::vector<Float3> indirect{{3, 3, 3}}, emitted{{1, 4, 0}};
  const Picture picture =
      render(scene.data(), {.indirect_irradiance = indirect, .emitted_irradiance = emitted},
             close_up({0, 0, 0}, Show::kRadiosity));
  EXPECT_NEAR(picture.pixel[4][0], 2 / kPi, 1e-5F);
  EXPECT_EQ(picture.pixel[4][1], 0);
  EXPECT_NEAR(picture.pixel[4][2], 3 / kPi, 1e-5F);
}

TEST(Picture, PointLightMatchesClosedFormInEveryPixel) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(5), scene.add_material({0.8F, 0.8F, 0.8F}));
  Light lamp;
  lamp.position = {0, 2, 0};
  lamp.intensity = 100;
  PictureSettings settings;
  settings.width = settings.height = 33;
  settings.camera = look_at({0, 4, 0}, {0, 0, 0}, kPi / 3);
  settings.show = Show::kDirect;
  const std::vector<Light> lights{lamp};
  const Picture picture = render(scene.data(), {.lights = lights}, settings);
  const float pixel_size = 2 * 4 * std::tan(kPi / 6) / 33;
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 33; ++x) {
      const float dx = static_cast<float>(x - 16) * pixel_size;
      const float dz = static_cast<float>(y - 16) * pixel_size;
      const float distance_squared = dx * dx + dz * dz + 4;
      const float expected =
          0.8F / kPi * 100 * 2 / (distance_squared * std::sqrt(distance_squared));
      // A pixel is the mean over 0.14 m of floor, by jittered samples.
      EXPECT_NEAR(picture.pixel[y * 33 + x][1], expected, 0.015F * expected) << x << ' ' << y;
    }
  }
}

TEST(Picture, SomethingBetweenLampAndFloorCastsAShadow) {
  SceneBuilder scene;
  const std::uint32_t white = scene.add_material({0.8F, 0.8F, 0.8F});
  scene.add_rectangle(floor_corners(5), white);
  scene.add_rectangle({{{-1, 1, 1}, {1, 1, 1}, {1, 1, -1}, {-1, 1, -1}}}, white);
  Light lamp;
  lamp.position = {0, 2, 0};
  const std::vector<Light> lights{lamp};
  const PictureLight light{.lights = lights};
  const Picture dark = render(scene.data(), light, close_up({0, 0, 0}, Show::kDirect));
  for (const Float3& pixel : dark.pixel) EXPECT_EQ(pixel[0], 0);
  const Picture lit = render(scene.data(), light, close_up({3, 0, 0}, Show::kDirect));
  for (const Float3& pixel : lit.pixel) EXPECT_GT(pixel[0], 0);
}

TEST(Picture, SquareLampMatchesTheViewFactorOfItsCorner) {
  // Howell's catalogue, a differential element below the corner of a parallel rectangle: 1 x 1 at
  // distance 1.
  constexpr float kViewFactor = 0.13853160599489F;
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(5), scene.add_material({0.5F, 0.5F, 0.5F}));
  scene.add_rectangle({{{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}}},
                      scene.add_material({0, 0, 0}, {10, 10, 10}));
  const Picture picture = render(scene.data(), {}, close_up({0, 0, 0}, Show::kDirect));
  for (const Float3& pixel : picture.pixel) {
    EXPECT_NEAR(pixel[0], 0.5F * 10 * kViewFactor, 0.01F * 0.5F * 10 * kViewFactor);
  }
}

TEST(Picture, UniformSkyLightsAnOpenFloorEvenly) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(5), scene.add_material({0.5F, 0.5F, 0.5F}));
  PictureLight light;
  light.sky = {.color = {1, 0.5F, 0.25F}, .luminance = 8};
  const Picture floor = render(scene.data(), light, close_up({0, 0, 0}, Show::kDirect));
  EXPECT_NEAR(floor.pixel[4][0], 4, 1e-4F);
  EXPECT_NEAR(floor.pixel[4][2], 1, 1e-4F);
  PictureSettings upward = close_up({0, 0, 0}, Show::kDirect);
  upward.exposure = -4;
  upward.camera = look_at({0, 1, 0}, {0, 2, 0}, 0.5F);
  const Picture sky = render(scene.data(), light, upward);
  EXPECT_NEAR(sky.pixel[4][1], 4, 1e-4F);
}

TEST(Picture, EmittersShowTheirLuminanceExceptInIndirect) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(5), scene.add_material({0, 0, 0}, {7, 8, 9}));
  PictureSettings settings = close_up({0, 0, 0}, Show::kDirect);
  settings.exposure = -4;
  EXPECT_NEAR(render(scene.data(), {}, settings).pixel[4][2], 9, 1e-4F);
  settings.exposure = 0;  // and no more than twice white, in their own hue
  const Picture dimmed = render(scene.data(), {}, settings);
  EXPECT_NEAR(dimmed.pixel[4][2], 2, 1e-4F);
  EXPECT_NEAR(dimmed.pixel[4][0], 2 * 7.0F / 9, 1e-4F);
  const Picture indirect = render(scene.data(), {}, close_up({0, 0, 0}, Show::kIndirect));
  EXPECT_EQ(indirect.pixel[4][2], 0);
}

TEST(Picture, CameraSeesThroughTheBackOfOneSidedSurfacesOnly) {
  SceneBuilder scene;
  const std::uint32_t dark = scene.add_material({0, 0, 0}, {1, 1, 1});
  const std::uint32_t bright = scene.add_material({0, 0, 0}, {5, 5, 5});
  scene.add_rectangle(floor_corners(1), dark);                                      // faces up
  scene.add_rectangle({{{-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}}}, bright);  // faces down
  PictureSettings settings = close_up({0, 0, 0}, Show::kRadiosity);
  settings.camera = look_at({0, 3, 0}, {0, 0, 0}, 0.02F);
  settings.exposure = -4;
  EXPECT_NEAR(render(scene.data(), {}, settings).pixel[4][0], 1, 1e-5F);
  scene.make_double_sided();
  EXPECT_NEAR(render(scene.data(), {}, settings).pixel[4][0], 5, 1e-5F);
}

// A dark floor that shines with 1 and above it a ceiling with 5, which faces up; the camera looks
// down on both.
class PaneOverFloor : public ::testing::Test {
 protected:
  PaneOverFloor() {
    scene_.add_rectangle(floor_corners(1), scene_.add_material({0, 0, 0}, {1, 1, 1}));
    pane_ = scene_.add_material({0, 0, 0}, {5, 5, 5});
    scene_.add_rectangle({{{-1, 1, 1}, {1, 1, 1}, {1, 1, -1}, {-1, 1, -1}}}, pane_);
    settings_ = close_up({0, 0, 0}, Show::kRadiosity);
    settings_.camera = look_at({0.1F, 3, 0.2F}, {0.1F, 0, 0.2F}, 0.02F);
    settings_.exposure = -4;
  }

  void let_through(AlphaMode mode, float alpha) {
    Material& material = scene_.data().materials[pane_];
    material.alpha_mode = mode;
    material.base_alpha = alpha;
    scene_.data().mesh.opacity = {{kNone, kNone, 0, 0}, {0, 1}, {128}};
  }

  float seen() {
    double sum = 0;
    for (const Float3& pixel : render(scene_.data(), {}, settings_).pixel) sum += pixel[0];
    return static_cast<float>(sum / 9);
  }

  SceneBuilder scene_;
  std::uint32_t pane_ = 0;
  PictureSettings settings_;
};

TEST_F(PaneOverFloor, IsSeenThroughHoles) {
  EXPECT_NEAR(seen(), 5, 1e-4F);
  let_through(AlphaMode::kMask, 0.7F);
  EXPECT_NEAR(seen(), 5, 1e-4F);
  let_through(AlphaMode::kMask, 0.3F);
  EXPECT_NEAR(seen(), 1, 1e-4F) << "the texture's alpha decides, not the map's half";
}

TEST_F(PaneOverFloor, BlendsWithWhatIsBehind) {
  let_through(AlphaMode::kBlend, 0.25F);
  EXPECT_NEAR(seen(), 0.25F * 5 + 0.75F, 1e-4F);
}

TEST_F(PaneOverFloor, CastsAShadowAsDarkAsItsMap) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({1, 1, 1}));
  const std::uint32_t glass = scene.add_material({1, 1, 1});
  scene.add_rectangle({{{-1, 1, 1}, {1, 1, 1}, {1, 1, -1}, {-1, 1, -1}}}, glass);
  scene.data().materials[glass].transmission = 0.75F;
  scene.data().mesh.opacity = {{kNone, kNone, 0, 0}, {0, 1}, {64}};
  Light lamp;
  lamp.position = {0, 2, 0};
  lamp.intensity = 100;
  const std::vector<Light> lights{lamp};
  const Picture picture =
      render(scene.data(), {.lights = lights}, close_up({0, 0, 0}, Show::kDirect));
  EXPECT_NEAR(picture.pixel[4][0], 25 * (1 - 64 / 255.0F) / kPi, 0.01F);
}

TEST(Picture, SecondSideIsShadedByItsOwnPatch) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({1, 1, 1}));
  scene.make_double_sided();
  ASSERT_EQ(scene.patch_count(), 2U);
  const std::vector<Float3> indirect{{1, 1, 1}, {2, 2, 2}};
  const PictureLight light{.indirect_irradiance = indirect};
  PictureSettings settings = close_up({0, 0, 0}, Show::kIndirect);
  EXPECT_NEAR(render(scene.data(), light, settings).pixel[4][0], 1 / kPi, 1e-5F);
  settings.camera = look_at({0.1F, -1, 0.2F}, {0.1F, 0, 0.2F}, 0.02F);
  EXPECT_NEAR(render(scene.data(), light, settings).pixel[4][0], 2 / kPi, 1e-5F);
}

TEST(Picture, VertexWithoutWeightsGetsNoIndirectLight) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(1), scene.add_material({1, 1, 1}));
  DisplayMesh& mesh = scene.data().mesh;
  mesh.weight_begin.assign(mesh.weight_begin.size(), 0);
  const std::vector<Float3> indirect{{1, 1, 1}};
  const Picture picture =
      render(scene.data(), {.indirect_irradiance = indirect}, close_up({0, 0, 0}, Show::kIndirect));
  EXPECT_EQ(picture.pixel[4][0], 0);
}

TEST(Picture, SameBitsForAnyNumberOfThreads) {
  SceneBuilder scene = lamp_room();
  Light lamp;
  lamp.position = {0.3F, 1.2F, 0.4F};
  const std::vector<Light> lights{lamp};
  const std::vector<Float3> indirect(scene.patch_count(), {2, 2, 2});
  const PictureLight light{.lights = lights, .indirect_irradiance = indirect};
  PictureSettings settings;
  settings.width = 70;
  settings.height = 50;
  settings.camera = look_at({0, 1, 0.9F}, {0, 1, 0}, 1.2F);
  const auto make = [&] { return render(scene.data(), light, settings); };
  const Picture one = test::with_threads(1, make), two = test::with_threads(2, make);
  EXPECT_EQ(std::memcmp(one.pixel.data(), two.pixel.data(), one.pixel.size() * sizeof(Float3)), 0);
  EXPECT_EQ(one.exposure, two.exposure);
}

TEST(Picture, DirectAndIndirectAddUpToRadiosity) {
  SceneBuilder scene = lamp_room();
  const std::vector<Float3> indirect(scene.patch_count(), {2, 2, 2});
  const PictureLight light{.indirect_irradiance = indirect};
  PictureSettings settings;
  settings.width = settings.height = 24;
  settings.camera = look_at({0, 1, 0.9F}, {0, 1, 0}, 1.2F);
  settings.exposure = 0;
  settings.show = Show::kDirect;
  const Picture direct = render(scene.data(), light, settings);
  settings.show = Show::kIndirect;
  const Picture bounced = render(scene.data(), light, settings);
  settings.show = Show::kRadiosity;
  const Picture both = render(scene.data(), light, settings);
  for (std::size_t k = 0; k < both.pixel.size(); ++k) {
    const float sum = direct.pixel[k][0] + bounced.pixel[k][0];
    EXPECT_NEAR(both.pixel[k][0], sum, 1e-5F * (1 + sum));
  }
}

TEST(Picture, ExposureBringsUniformGreyToAQuarterOfWhiteAndCanBeFixed) {
  SceneBuilder scene;
  scene.add_rectangle(floor_corners(5), scene.add_material({0.5F, 0.5F, 0.5F}));
  const std::vector<Float3> indirect{{4000, 4000, 4000}};
  const PictureLight light{.indirect_irradiance = indirect};
  PictureSettings settings = close_up({0, 0, 0}, Show::kRadiosity);
  const Picture automatic = render(scene.data(), light, settings);
  EXPECT_NEAR(automatic.pixel[4][0] * std::exp2(automatic.exposure), 0.25F, 1e-4F);
  settings.exposure = -3;
  EXPECT_EQ(render(scene.data(), light, settings).exposure, -3);
}

TEST(Picture, TextureIsFilteredAndMultiplied) {
  SceneBuilder scene;
  const std::uint32_t tinted = scene.add_material({0.5F, 1, 0.25F});
  scene.add_rectangle(floor_corners(1), tinted);
  // A checkerboard of black and white texels: its mean is one half in linear light.
  ScreenImage checker{.width = 64, .height = 64};
  for (int k = 0; k < 64 * 64; ++k) {
    checker.rgb.insert(checker.rgb.end(), 3, (k / 64 + k) % 2 == 0 ? 255 : 0);
  }
  const test::TemporaryFolder folder;
  const auto path = folder / "checker.png";
  write_png(path, checker);
  std::FILE* file = std::fopen(path.c_str(), "rb");
  ASSERT_NE(file, nullptr);
  Texture texture;
  for (int byte; (byte = std::fgetc(file)) != EOF;) {
    texture.encoded.push_back(static_cast<std::uint8_t>(byte));
  }
  std::fclose(file);
  scene.data().textures.push_back(texture);
  scene.data().materials[tinted].base_color_texture = 0;
  const std::vector<Float3> indirect{{kPi, kPi, kPi}};
  PictureSettings settings;
  settings.width = settings.height = 5;  // about 20 x 20 texels in a pixel
  settings.camera = look_at({0, 5, 0}, {0, 0, 0}, 0.25F);
  settings.show = Show::kIndirect;
  const Picture far = render(scene.data(), {.indirect_irradiance = indirect}, settings);
  for (const Float3& pixel : far.pixel) {
    EXPECT_NEAR(pixel[0], 0.25F, 0.01F);
    EXPECT_NEAR(pixel[1], 0.5F, 0.01F);
    EXPECT_NEAR(pixel[2], 0.125F, 0.01F);
  }
  settings.camera = look_at({0.0156F, 0.5F, 0.0156F}, {0.0156F, 0, 0.0156F}, 0.01F);
  const Picture near = render(scene.data(), {.indirect_irradiance = indirect}, settings);
  EXPECT_TRUE(near.pixel[12][1] > 0.9F || near.pixel[12][1] < 0.1F) << near.pixel[12][1];
}

TEST(Picture, DamagedTextureIsRefused) {
  SceneBuilder scene;
  const std::uint32_t white = scene.add_material({1, 1, 1});
  scene.add_rectangle(floor_corners(1), white);
  scene.data().textures.push_back(
      Texture{{0x89, 0x50, 0x4e, 0x47, 1, 2, 3}, TextureWrap::kRepeat, TextureWrap::kRepeat});
  scene.data().materials[white].base_color_texture = 0;
  EXPECT_THROW(render(scene.data(), {}, close_up({0, 0, 0}, Show::kDirect)), Error);
}

TEST(Picture, PatchesAndErrorsAreColors) {
  SceneBuilder scene = lamp_room();
  std::vector<float> error(scene.patch_count());
  for (std::size_t k = 0; k < error.size(); ++k) error[k] = static_cast<float>(k);
  PictureSettings settings = close_up({0, 0, 0.8F}, Show::kPatches);
  const Picture patches = render(scene.data(), {}, settings);
  EXPECT_TRUE(patches.display_referred);
  EXPECT_GT(patches.pixel[4][0], 0.02F);
  settings.show = Show::kError;
  const Picture errors = render(scene.data(), {.error = error}, settings);
  const ScreenImage screen = tone_map(errors);
  EXPECT_NEAR(screen.rgb[0], 68, 1) << "the floor is patch 0, with no error: viridis' low end";
  EXPECT_NEAR(screen.rgb[2], 84, 1);
  EXPECT_THROW(render(scene.data(), {}, settings), Error);
}

TEST(Picture, WrongInputsAreRefused) {
  SceneBuilder scene = lamp_room();
  const std::vector<Float3> short_array(3);
  PictureSettings settings = close_up({0, 0, 0}, Show::kDirect);
  EXPECT_THROW(render(scene.data(), {.indirect_irradiance = short_array}, settings), Error);
  settings.width = 0;
  EXPECT_THROW(render(scene.data(), {}, settings), Error);
  settings.width = 3;
  settings.samples_per_axis = 0;
  EXPECT_THROW(render(scene.data(), {}, settings), Error);
  EXPECT_THROW(look_at({1, 2, 3}, {1, 2, 3}, 1), Error);
  EXPECT_THROW(look_at({1, 2, 3}, {0, 0, 0}, 4), Error);
}

TEST(ToneMap, KeepsMidtonesAndHue) {
  const Picture picture{.width = 3,
                        .height = 1,
                        .pixel = {{0.18F, 0.18F, 0.18F}, {0.4F, 0.1F, 0.05F}, {1e6F, 1e6F, 1e6F}}};
  const ScreenImage image = tone_map(picture);
  EXPECT_EQ(image.rgb[0], 118);  // sRGB of 0.18
  EXPECT_EQ(image.rgb[3], 170);  // of 0.4
  EXPECT_EQ(image.rgb[4], 89);   // of 0.1
  EXPECT_EQ(image.rgb[6], 255);
}

TEST(ToneMap, BrighterStaysBrighter) {
  // At one and the same place: neighbours are dithered apart by up to one step.
  ScreenImage before = tone_map({.width = 4, .height = 4, .pixel = std::vector<Float3>(16)});
  for (int k = 1; k < 400; ++k) {
    const float y = 0.01F * static_cast<float>(k);
    const Float3 pixel{y, 0.5F * y, 0.25F * y};
    const ScreenImage image =
        tone_map({.width = 4, .height = 4, .pixel = std::vector<Float3>(16, pixel)});
    for (std::size_t b = 0; b < image.rgb.size(); ++b) ASSERT_GE(image.rgb[b], before.rgb[b]);
    before = image;
  }
}

TEST(ToneMap, DitheringKeepsTheMeanAndExactBlack) {
  constexpr int kSide = 64;
  constexpr float kLight = 0.2F;
  const auto flat = [](float y) {
    return tone_map(
        {.width = kSide, .height = kSide, .pixel = std::vector<Float3>(kSide * kSide, {y, y, y})});
  };
  const ScreenImage image = flat(kLight);
  double sum = 0;
  for (const std::uint8_t byte : image.rgb) sum += byte;
  const double mean = sum / static_cast<double>(image.rgb.size());
  const auto [low, high] = std::ranges::minmax(image.rgb);
  EXPECT_LE(high - low, 1);
  EXPECT_GT(mean, low);
  EXPECT_LT(mean, high);
  for (const std::uint8_t byte : flat(0).rgb) EXPECT_EQ(byte, 0);
}

TEST(Png, IsWrittenAndReadBack) {
  ScreenImage image{.width = 7, .height = 5};
  for (int k = 0; k < 7 * 5 * 3; ++k) image.rgb.push_back(static_cast<std::uint8_t>(k * 37));
  const test::TemporaryFolder folder;
  const auto path = folder / "picture.png";
  write_png(path, image);
  const std::string bytes = test::read_bytes(path);
  const auto read =
      decode_png_or_jpeg({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->width, 7);
  EXPECT_EQ(read->height, 5);
  for (std::size_t k = 0; k < image.rgb.size(); ++k) {
    ASSERT_EQ(read->rgba[k / 3 * 4 + k % 3], image.rgb[k]) << k;
  }
  EXPECT_EQ(folder.names(), std::vector<std::string>{"picture.png"}) << "nothing else is left";
}

TEST(Png, MissingFolderIsAnError) {
  const ScreenImage image{.width = 1, .height = 1, .rgb = {1, 2, 3}};
  EXPECT_THROW(write_png("/no/such/folder/picture.png", image), Error);
}

TEST(Camera, LookAtIsOrthonormalAndAims) {
  const Camera camera = look_at({1, 2, 3}, {1, 2, -3}, 1);
  EXPECT_EQ(camera.backward, (Float3{0, 0, 1}));
  EXPECT_EQ(camera.right, (Float3{1, 0, 0}));
  EXPECT_EQ(camera.up, (Float3{0, 1, 0}));
  const Camera down = look_at({0, 5, 0}, {0, 0, 0}, 1);
  EXPECT_NEAR(down.backward[1], 1, 1e-6F);
  EXPECT_NEAR(std::abs(down.right[0]), 1, 1e-6F);
}

}  // namespace
}  // namespace rebounce::test_picture

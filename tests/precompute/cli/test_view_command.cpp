// The viewer by the pictures it draws without a window, and what it says where there is no display.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "rebounce/engine.h"
#include "runtime/images/coded_image.h"
#include "tests/support/command_line.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_view_command {
namespace {

using nlohmann::json;
using test::CommandLine;
using test::kBadInput;
using test::kDone;
using test::kLights;
using test::kScene;
using test::kScenes;
using test::kUsage;
using test::Outcome;
using test::Words;

struct Image {
  int width = 0, height = 0;
  std::vector<int> rgb;

  double mean(int channel) const {
    double sum = 0;
    for (std::size_t k = static_cast<std::size_t>(channel); k < rgb.size(); k += 3) sum += rgb[k];
    return 3 * sum / static_cast<double>(rgb.size());
  }
};

Image read_image(const std::string& path) {
  const std::string bytes = test::read_bytes(path);
  const auto read =
      decode_png_or_jpeg({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  EXPECT_TRUE(read) << path;
  if (!read) return {};
  Image image{read->width, read->height, {}};
  for (std::size_t k = 0; k < read->rgba.size(); ++k) {
    if (k % 4 != 3) image.rgb.push_back(read->rgba[k]);
  }
  return image;
}

struct Difference {
  double mean = 0;
  int largest = 0;
};

Difference difference(const Image& a, const Image& b) {
  EXPECT_EQ(a.rgb.size(), b.rgb.size());
  Difference d;
  for (std::size_t k = 0; k < std::min(a.rgb.size(), b.rgb.size()); ++k) {
    const int apart = std::abs(a.rgb[k] - b.rgb[k]);
    d.mean += apart / static_cast<double>(a.rgb.size());
    d.largest = std::max(d.largest, apart);
  }
  return d;
}

class ViewCommand : public CommandLine {
 protected:
  /// Drivers of OpenGL are unloaded at the end; the leak sanitizer then finds nothing that points
  /// to what they keep.
  static void SetUpTestSuite() { setenv("LSAN_OPTIONS", "detect_leaks=0", 1); }
  static void TearDownTestSuite() { unsetenv("LSAN_OPTIONS"); }

  void SetUp() override {
    // The viewer can be left out of a build; ./dev test leaves it in.
    const Outcome help = run({"view", "--help"});
    if (help.err.find("unknown command \"view\"") != std::string::npos) {
      GTEST_SKIP() << "this build has no viewer (REBOUNCE_BUILD_VIEWER)";
    }
    ASSERT_EQ(help.exit_code, kDone) << help.err;
    // As few patches as show colours bleed: it is the drawing that is looked at.
    file_ = built("box.safetensors", {"--patches", "120", "--store-form-factors"});
    const Outcome outcome =
        run({"view", file_, "--size", "16x16", "--screenshot", path("try.png")});
    // ./dev test installs a software renderer; other machines may have none.
    if (outcome.err.find("no OpenGL 3.3 without a window") != std::string::npos) {
      GTEST_SKIP() << "no OpenGL here: " << outcome.err;
    }
    EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  }

  Image screenshot(Words options, const std::string& name = "picture.png") {
    Words words = {"view", file_, "--size", "240x160", "--quiet", "--screenshot", path(name)};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
    return read_image(path(name));
  }

  /// A furnished room of few patches.
  std::string furnished_room() {
    return built("room.safetensors", {"--tolerance", "0.05"}, kScenes + "furnished_room.gltf");
  }

  std::string file_;
};

TEST_F(ViewCommand, DrawsALitScene) {
  const Image image = screenshot({"--lights", kLights});
  EXPECT_EQ(image.width, 240);
  EXPECT_EQ(image.height, 160);
  for (int c = 0; c < 3; ++c) {
    EXPECT_GT(image.mean(c), 25);
    EXPECT_LT(image.mean(c), 200);
  }
  // More than 16-bit floats hold is white.
  const Image white = screenshot({"--lights", kLights, "--exposure", "30"});
  ASSERT_EQ(white.rgb.size(), image.rgb.size());
  for (std::size_t k = 0; k < white.rgb.size(); ++k) {
    if (image.rgb[k] <= 20) continue;
    ASSERT_GT(white.rgb[k], 250) << "value " << k;
  }
}

TEST_F(ViewCommand, SharesItsFileWithEngines) {
  const std::string alone = path("alone.png"), beside = path("beside.png");
  const auto show = [&](const std::string& picture) {
    EXPECT_EQ(
        run({"view", file_, "--lights", kLights, "--quiet", "--screenshot", picture}).exit_code,
        kDone);
    return test::read_bytes(picture);
  };
  const std::string drawn = show(alone);

  constexpr int kPlaces = 16;
  const auto frame = [](Engine& engine, int place) {
    Light lamp;
    lamp.position = {0.1F + 0.02F * static_cast<float>(place), 0.3F, 0.1F};
    engine.relight({&lamp, 1}, {});
    return std::vector<Float3>(engine.radiosity().begin(), engine.radiosity().end());
  };
  const auto data = std::make_shared<const TransferData>(load_transfer_file(file_));
  std::vector<std::vector<Float3>> expected;
  Engine first(data);
  for (int place = 0; place < kPlaces; ++place) expected.push_back(frame(first, place));

  std::atomic<bool> is_drawn = false;
  std::atomic<int> frames = 0, wrong = 0;
  const auto play = [&](int begin) {
    Engine engine(data);
    for (int k = begin; !is_drawn || k < begin + kPlaces; ++k) {
      if (frame(engine, k % kPlaces) != expected[static_cast<std::size_t>(k % kPlaces)]) ++wrong;
      ++frames;
    }
  };
  std::thread one(play, 0), other(play, 5);
  const std::string drawn_beside = show(beside);
  is_drawn = true;
  one.join();
  other.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GE(frames, 2 * kPlaces);
  EXPECT_TRUE(drawn == drawn_beside);
}

TEST_F(ViewCommand, LooksAsThePictureOfRender) {
  const Outcome outcome = run({"render", file_, "--lights", kLights, "--size", "240x160",
                               "--exposure", "-4", "--quiet", "-o", path("render.png")});
  EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  const Image image = screenshot({"--lights", kLights, "--exposure", "-4"});
  // Shadow borders and edges may differ, and no more.
  EXPECT_LT(difference(image, read_image(path("render.png"))).mean, 2.0);
}

TEST_F(ViewCommand, FindsTheExposureOfRender) {
  const Outcome outcome = run({"render", file_, "--lights", kLights, "--size", "240x160", "--quiet",
                               "-o", path("render.png")});
  EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  EXPECT_LT(difference(screenshot({"--lights", kLights}), read_image(path("render.png"))).mean,
            2.5);
}

TEST_F(ViewCommand, LampsWithASurfaceLookAsRenderDrawsThem) {
  // The camera looks in from the front; the lamps hang above its view.
  const std::string place = R"("position": [0.278, 0.53, 0.28], )";
  const std::vector<std::string> lamps = {
      R"({"type": "sphere", "radius": 0.015, "intensity": 30000, )" + place + R"("range": 0})",
      R"({"type": "rectangle", "width": 0.2, "height": 0.1, "intensity": 1500, )" + place +
          R"("direction": [0, -1, 0]})",
      R"({"type": "disc", "radius": 0.08, "intensity": 1500, )" + place +
          R"("direction": [0, -1, 0]})"};
  for (const std::string& lamp : lamps) {
    const std::string lights = write("area.lights.json", R"({"lights": [)" + lamp + "]}");
    const Outcome outcome = run({"render", file_, "--lights", lights, "--size", "240x160",
                                 "--quiet", "--exposure", "-7", "-o", path("render.png")});
    EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
    const Image drawn = read_image(path("render.png"));
    EXPECT_GT(drawn.mean(0), 20) << lamp;
    const Image image = screenshot({"--lights", lights, "--exposure", "-7"});
    // Half shadows are a guess; see the shader.
    EXPECT_LT(difference(image, drawn).mean, 2.5) << lamp;
  }
}

TEST_F(ViewCommand, AnEmittingRectangleLooksAsRenderDrawsIt) {
  const Outcome outcome = run({"render", file_, "--size", "240x160", "--show", "direct", "--quiet",
                               "--exposure", "-5", "-o", path("render.png")});
  EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  const Image drawn = read_image(path("render.png"));
  EXPECT_GT(drawn.mean(0), 20);
  // Light at the vertices of 120 patches is 1.6 off.
  EXPECT_LT(difference(screenshot({"--show", "direct", "--exposure", "-5"}), drawn).mean, 0.9);
}

TEST_F(ViewCommand, TheGraphicsCardShowsThePictureOfTheProcessor) {
  const Outcome tried = run({"view", file_, "--size", "16x16", "--method", "graphics-card",
                             "--screenshot", path("try.png")});
  // The software renderer that ./dev test installs has it; drivers of other machines may not.
  if (tried.err.find("OpenGL 4.3 is needed") != std::string::npos) GTEST_SKIP() << tried.err;
  EXPECT_NE(tried.out.find("graphics card "), std::string::npos) << tried.out;
  EXPECT_EQ(tried.out.find("graphics card 0.00"), std::string::npos) << tried.out;
  // A point, which the card lights itself; a sphere and a sky, which the processor gives it.
  const std::string mixed = write("mixed.lights.json", R"({"lights": [
      {"type": "point", "position": [0.2, 0.4, 0.1], "intensity": 20, "color": [1, 0.6, 0.3]},
      {"type": "sphere", "radius": 0.015, "intensity": 30000, "position": [0.278, 0.53, 0.28]}],
      "sky": {"luminance": 100}})");
  for (const std::string& lights : {std::string(kLights), mixed}) {
    const Words light = {"--lights", lights, "--exposure", "-6", "--show", "indirect"};
    Words on_card = light;
    on_card.insert(on_card.end(), {"--method", "graphics-card"});
    const Image drawn = screenshot(light);
    EXPECT_GT(drawn.mean(0), 5) << lights;
    // Borders of shadows from a map and from eight rays differ a little.
    const Difference apart = difference(screenshot(on_card, "card.png"), drawn);
    EXPECT_LT(apart.mean, 1.0) << lights;
    EXPECT_LT(apart.largest, 12) << lights;
  }
}

TEST_F(ViewCommand, SaysWhyTheGraphicsCardRefusesAScene) {
  const std::string dense = path("dense.safetensors");
  ASSERT_EQ(run(test::quick({"precompute", kScene, "--patches", "120", "--operator", "dense",
                             "--quiet", "-o", dense}))
                .exit_code,
            kDone);
  expect_refused({"view", dense, "--method", "graphics-card", "--size", "16x16", "--screenshot",
                  path("no.png")},
                 "hierarchical operators alone");
}

TEST_F(ViewCommand, ASkyByCellsLooksAsRenderDrawsIt) {
  const std::string lights = write("sky.lights.json", R"({"sky":
      {"luminance": 300, "cie": 12, "sunDirection": [-1, -0.3, 0.4], "groundReflectance": 0.6}})");
  const Words light = {"--lights", lights, "--exposure", "-8"};
  Words words = {"render", file_, "--size", "240x160", "--quiet", "-o", path("render.png")};
  words.insert(words.end(), light.begin(), light.end());
  const Outcome outcome = run(words);
  EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  const Image drawn = read_image(path("render.png"));
  EXPECT_GT(drawn.mean(0), 20);
  EXPECT_LT(difference(screenshot(light), drawn).mean, 2.0);
}

TEST_F(ViewCommand, NoSunShinesThroughTheSeamsOfAClosedRoom) {
  const std::string room = furnished_room();
  const std::string sun = write("sun.lights.json", R"({"lights": [
      {"type": "directional", "direction": [-0.6, -0.6, -0.9], "intensity": 20000}]})");
  const Outcome outcome = run({"view", room, "--lights", sun, "--exposure", "-9", "--quiet",
                               "--screenshot", path("dark.png")});
  EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  const Image dark = read_image(path("dark.png"));
  ASSERT_EQ(dark.width, 1280);
  // A thousand of its pixels are on seams; at a low angle single ones are still found lit.
  EXPECT_LE(std::ranges::count_if(dark.rgb, [](int value) { return value > 40; }), 3 * 40);
}

TEST_F(ViewCommand, ACeilingIsSmoothAroundALampBelowIt) {
  const std::string lamp = write("lamp.lights.json", R"({"lights": [
      {"type": "point", "position": [1.5, 2.2, 1.5], "intensity": 60}]})");
  const Outcome outcome = run({"view", furnished_room(), "--lights", lamp, "--exposure", "-5",
                               "--show", "direct", "--quiet", "--screenshot", path("ceiling.png")});
  EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
  const Image image = read_image(path("ceiling.png"));
  ASSERT_EQ(image.width, 1280);
  const auto green = [&](int x, int y) { return image.rgb[3 * (1280 * y + x) + 1]; };
  constexpr int kReach = 2;
  int dashes = 0;
  for (int y = kReach; y < 95; ++y) {
    for (int x = 300; x < 760; ++x) {
      std::vector<int> around;
      for (int v = y - kReach; v <= y + kReach; ++v) {
        for (int u = x - kReach; u <= x + kReach; ++u) around.push_back(green(u, v));
      }
      const auto middle = around.begin() + around.size() / 2;
      std::ranges::nth_element(around, middle);
      dashes += *middle - green(x, y) > 8 ? 1 : 0;
    }
  }
  EXPECT_LE(dashes, 20) << "edges of triangles shade themselves";
}

TEST_F(ViewCommand, WhatIsMaskedAwayIsNotDrawn) {
  std::ifstream scene(kScene);
  json document = json::parse(scene);
  json& red = document["materials"][2];
  red["alphaMode"] = "MASK";
  red["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.2;
  const std::string masked = write("masked.gltf", document.dump());
  const Words light = {"--lights", kLights, "--exposure", "-4", "--size", "240x160", "--quiet"};
  const auto draw = [&](Words words, const std::string& picture) {
    words.insert(words.end(), light.begin(), light.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, kDone) << outcome.err;
    return read_image(picture);
  };
  const std::string file = path("masked.safetensors");
  ASSERT_EQ(
      run(test::quick({"precompute", masked, "--patches", "120", "--quiet", "-o", file})).exit_code,
      kDone);
  const Image image = draw({"view", file, "--screenshot", path("masked.png")}, path("masked.png"));
  const Image drawn = draw({"render", file, "-o", path("render.png")}, path("render.png"));
  EXPECT_LT(difference(image, drawn).mean, 2.0);
  EXPECT_GT(difference(image, screenshot({"--lights", kLights, "--exposure", "-4"})).mean, 5);
}

TEST_F(ViewCommand, ASphereTakesTheColourOfTheWallsThatItFaces) {
  const std::string still = write("still.json", R"({"spheres":
      [{"position": [0.278, 0.3, 0.1], "radius": 0.08, "color": [0.9, 0.9, 0.9]}]})");
  const Words words = {"--lights", kLights, "--show", "indirect", "--exposure", "-3"};
  const Image without = screenshot(words);
  Words with = words;
  with.insert(with.end(), {"--path", still});
  const Image image = screenshot(with);
  // By columns, of the pixels that the sphere changes.
  std::vector<int> columns;
  std::vector<double> redness;
  for (int x = 0; x < image.width; ++x) {
    double red = 0, green = 0;
    for (int y = 0; y < image.height; ++y) {
      const auto k = 3 * static_cast<std::size_t>(y * image.width + x);
      if (image.rgb[k] == without.rgb[k] && image.rgb[k + 1] == without.rgb[k + 1]) continue;
      red += image.rgb[k];
      green += image.rgb[k + 1];
    }
    if (red + green == 0) continue;
    columns.push_back(x);
    redness.push_back(red / green);
  }
  ASSERT_GT(columns.size(), 20U);
  const std::size_t quarter = columns.size() / 4;
  // The left wall is red, the right one green.
  EXPECT_GT(redness[quarter], 1.15 * redness[columns.size() - quarter]);
}

TEST_F(ViewCommand, ASphereCastsShadowsAndCanBeLeftOut) {
  const Words words = {"--lights", kLights, "--show", "direct", "--exposure", "-4"};
  const Image without = screenshot(words);
  Words with = words;
  with.push_back("--sphere");
  EXPECT_GT(difference(screenshot(with), without).mean, 0.5);
  Words panels = with;
  panels.push_back("--panels");
  EXPECT_GT(difference(screenshot(panels), without).mean, 5);
}

TEST_F(ViewCommand, AddsUpDirectAndBouncedLight) {
  const Words common = {"--lights", kScenes + "spot_on_red_wall.lights.json", "--exposure", "-5"};
  const auto show = [&](const std::string& what) {
    Words options = common;
    options.insert(options.end(), {"--show", what});
    return screenshot(options, what + ".png");
  };
  const Image all = show("radiosity"), direct = show("direct"), indirect = show("indirect");
  EXPECT_GT(all.mean(0), direct.mean(0));
  EXPECT_GT(all.mean(0), indirect.mean(0));
  // The red wall colours what it sends on.
  EXPECT_GT(indirect.mean(0), 1.15 * indirect.mean(2));
  EXPECT_GT(difference(show("patches"), all).mean, 20);
}

TEST_F(ViewCommand, SplitsTheScreenBetweenMethods) {
  const Words same = {"--lights", kLights, "--exposure", "-4", "--against", "refine"};
  const Words poor = {"--lights", kLights, "--exposure", "-4", "--against", "gathering", "--cold"};
  const Image exact = screenshot({"--lights", kLights, "--exposure", "-4"});
  // Refinement gives what the product does to its tolerance, apart from the line between.
  EXPECT_LT(difference(screenshot(same), exact).mean, 1.5);
  const Image split = screenshot(poor);
  double left = 0, right = 0;
  for (int y = 0; y < split.height; ++y) {
    for (int x = 0; x < split.width; ++x) {
      if (std::abs(x - split.width / 2) < 3) continue;
      const auto k = 3 * static_cast<std::size_t>(y * split.width + x);
      (x < split.width / 2 ? left : right) += std::abs(split.rgb[k] - exact.rgb[k]);
    }
  }
  EXPECT_LT(left, 0.01 * right);
}

TEST_F(ViewCommand, ShowsTheErrorOfAnIteration) {
  const Image exact = screenshot({"--lights", kLights, "--show", "error", "--method", "gathering"});
  EXPECT_GT(exact.mean(1), 10);
}

TEST_F(ViewCommand, ComparesOnlyWhereThereAreFormFactors) {
  const std::string file = path("without.safetensors");
  ASSERT_EQ(
      run(test::quick({"precompute", kScene, "--patches", "120", "--quiet", "-o", file})).exit_code,
      kDone);
  const Words words = {"view",   file,    "--lights",     kLights,
                       "--size", "32x24", "--screenshot", path("without.png")};
  for (const Words& what : {Words{"--show", "error"}, Words{"--against", "refine"},
                            Words{"--method", "gauss-seidel"}}) {
    Words with = words;
    with.insert(with.end(), what.begin(), what.end());
    expect_refused(with, "--store-form-factors");
  }
  EXPECT_EQ(run(words).exit_code, kDone);
}

TEST_F(ViewCommand, DrawsPanels) {
  const Image without = screenshot({"--lights", kLights});
  EXPECT_GT(difference(screenshot({"--lights", kLights, "--panels"}), without).mean, 5);
}

TEST_F(ViewCommand, MovesLampsSmoothlyAlongAPath) {
  const std::string motion = write("path.json",
                                   R"({"frames_per_second": 50, "motions": [{"light": 0, "swing":
          {"from": [0.2, 0.45, 0.2], "to": [0.35, 0.45, 0.3], "period": 2}}]})");
  const json summary =
      summary_of({"view", file_, "--lights", kLights, "--size", "120x80", "--show", "indirect",
                  "--path", motion, "--frames", "6", "--out", path("film")});
  EXPECT_EQ(summary["frames"], 6);
  EXPECT_GT(summary["microseconds"]["draw"], 0);
  const auto frame = [&](int k) {
    return read_image(path("film/frame_0000" + std::to_string(k) + ".png"));
  };
  const Image begin = frame(0), end = frame(5);
  EXPECT_GT(difference(begin, end).mean, 0.05);
  for (int k = 0; k < 5; ++k) {
    // No step is larger than a tenth of the screen's range, anywhere.
    EXPECT_LT(difference(frame(k), frame(k + 1)).largest, 26) << "frame " << k;
  }
}

TEST_F(ViewCommand, ASphereDoesNotPopOnItsWay) {
  // At even speed, past the blocks and through cells of probes of which some are within them.
  const std::string motion = write("sphere.json", R"({"frames_per_second": 8, "spheres":
      [{"radius": 0.05, "keys": [{"time": 0, "position": [0.1, 0.42, 0.0]},
                                 {"time": 1, "position": [0.45, 0.36, 0.3]}]}]})");
  summary_of({"view", file_, "--lights", kLights, "--size", "120x80", "--exposure", "-4", "--path",
              motion, "--frames", "8", "--out", path("film")});
  std::vector<double> change;
  for (int k = 0; k < 7; ++k) {
    const auto frame = [&](int n) {
      return read_image(path("film/frame_0000" + std::to_string(n) + ".png"));
    };
    change.push_back(difference(frame(k), frame(k + 1)).mean);
  }
  const double largest = *std::ranges::max_element(change);
  std::ranges::sort(change);
  EXPECT_GT(change.front(), 0.02);
  EXPECT_LT(largest, 2 * change[change.size() / 2]);
}

TEST_F(ViewCommand, RefusesPathsThatMakeNoSense) {
  const auto refused = [&](const std::string& text, const std::string& part) {
    const std::string motion = write("path.json", text);
    const Outcome outcome = run({"view", file_, "--lights", kLights, "--path", motion,
                                 "--screenshot", path("no.png"), "--quiet"});
    EXPECT_EQ(outcome.exit_code, kBadInput);
    EXPECT_TRUE(test::is_one_line(outcome.err)) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  };
  refused("{", "is truncated: it ends at byte 1");
  refused("{1}", "is not JSON: parse error at line 1");
  refused(R"({"motion": []})", "unknown field");
  refused(R"({"motions": [{"light": 7, "circle": {}}]})", "\"light\"");
  refused(R"({"motions": [{"light": 0}]})", "must have one of");
  refused(R"({"motions": [{"circle": {"period": 0}}]})", "period");
  refused(R"({"motions": [{"circle": {"axis": [0, 0, 0]}}]})", "axis");
  refused(R"({"motions": [{"keys": []}]})", "keys");
  refused(R"({"motions": [{"keys": [{"time": 2}, {"time": 1}]}]})", "key 1: \"time\"");
  refused(R"({"frames_per_second": 0})", "frames_per_second");
  refused(R"({"spheres": {}})", "spheres");
  refused(R"({"spheres": [{"position": [0, 1, 0]}]})", "sphere 0: \"radius\"");
  refused(R"({"spheres": [{"radius": 1, "circle": {}, "swing": {}}]})", "must have one of");
  refused(R"({"spheres": [{"radius": 1, "light": 0}]})", "unknown field");
}

TEST_F(ViewCommand, SaysInOneLineThatThereIsNoDisplay) {
  const Outcome outcome = test::Subprocess({"/usr/bin/env", "-u", "DISPLAY", "-u",
                                            "WAYLAND_DISPLAY", REBOUNCE_PROGRAM, "view", file_},
                                           printed_ / "out", printed_ / "err")
                              .finish();
  EXPECT_EQ(outcome.exit_code, kBadInput);
  EXPECT_TRUE(test::is_one_line(outcome.err)) << outcome.err;
  EXPECT_NE(outcome.err.find("cannot open a window"), std::string::npos) << outcome.err;
  // A path moves lamps in the window too; it is --out that does without one.
  EXPECT_NE(outcome.err.find("--out FOLDER"), std::string::npos) << outcome.err;
  EXPECT_EQ(run({"view", file_, "--frames", "3"}).exit_code, kUsage);
}

}  // namespace
}  // namespace rebounce::test_view_command

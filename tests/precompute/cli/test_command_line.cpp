// The program `rebounce` as scripts see it: exit status, what it prints where, what it writes.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "precompute/compression/hierarchical_settings.h"
#include "tests/support/command_line.h"

namespace rebounce::test_command_line {
namespace {

using nlohmann::json;
using test::CommandLine;
using test::kDone;
using test::kLights;
using test::kPatchCount;
using test::kScene;
using test::kScenes;
using test::kUsage;
using test::Names;
using test::Outcome;
using test::Words;

TEST_F(CommandLine, HelpsAndTellsItsVersion) {
  EXPECT_TRUE(run({"--version"}).out.starts_with("rebounce "));
  for (const Words& words : {Words{"--help"},
                             {"precompute", "--help"},
                             {"info", "--help"},
                             {"solve", "--help"},
                             {"export", "--help"},
                             {"render", "--help"},
                             {"bake", "--help"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, kDone) << words.front();
    EXPECT_NE(outcome.out.find("Usage: "), std::string::npos) << words.front();
    EXPECT_EQ(outcome.err, "") << words.front();
  }
}

TEST_F(CommandLine, RefusesWrongUsageWithStatusTwo) {
  const std::string out = path("out.safetensors");
  const std::pair<Words, std::string> cases[] = {
      {{}, "subcommand"},
      {{"relight"}, "relight"},
      {{"--frob"}, "--frob"},
      {{"precompute"}, "required"},
      {{"precompute", kScene}, "--output"},
      {{"precompute", kScene, "-o", out, "--frob"}, "--frob"},
      {{"precompute", kScene, "-o", out, "--patches", "0"}, "--patches"},
      {{"precompute", kScene, "-o", out, "--patches", "many"}, "--patches"},
      {{"precompute", kScene, "-o", out, "--patch-size", "-1"}, "--patch-size"},
      {{"precompute", kScene, "-o", out, "--patches", "9", "--patch-size", "1"}, "--patch-size"},
      {{"precompute", kScene, "-o", out, "--operator", "cubic"}, "--operator"},
      {{"precompute", kScene, "-o", out, "--tolerance", "2"}, "--tolerance"},
      {{"precompute", kScene, "-o", out, "--precision", "f8"}, "--precision"},
      {{"precompute", kScene, "-o", out, "--memory-limit", "0"}, "--memory-limit"},
      {{"precompute", kScene, "-o", out, "--threads", "-1"}, "--threads"},
      {{"info"}, "required"},
      {{"solve", out}, "--output"},
      {{"solve", out, "-o", path("x.txt")}, ".npz"},
      {{"solve", out, "-o", path("x.csv"), "--method", "guess"}, "--method"},
      {{"solve", out, "-o", path("x.csv"), "--iterations", "0"}, "--iterations"},
      {{"solve", out, "-o", path("x.csv"), "--error", "0"}, "--error"},
      {{"solve", out, "-o", path("x.csv"), "--residual", "-1"}, "--residual"},
      {{"export", out, "-o", path("x.npz")}, "--what"},
      {{"export", out, "-o", path("x.csv"), "--what", "mesh"}, ".npz"},
      {{"render", out, "-o", path("x.jpg")}, ".png"},
      {{"render", out, "-o", path("x.png"), "--show", "all"}, "--show"},
  };
  for (const auto& [words, part] : cases) {
    expect_failure(words, part, kUsage);
  }
  EXPECT_EQ(folder_.names(), Names{});
}

TEST_F(CommandLine, RefusesBadInputInOneLine) {
  const std::string file = built("box.safetensors");
  const std::string nowhere = path("missing/x");
  expect_refused({"precompute", path("no.glb"), "-o", path("x.safetensors")}, "no.glb");
  expect_refused({"precompute", write("no.gltf", "{"), "-o", path("x.safetensors")}, "no.gltf");
  expect_refused({"precompute", kScene, "-o", nowhere}, "create the folder");
  expect_refused({"info", path("no.safetensors")}, "no.safetensors");
  expect_refused({"info", kScene}, "cornell_box.gltf");
  expect_refused({"solve", path("no.safetensors"), "-o", path("x.csv")}, "no.safetensors");
  expect_refused({"solve", file, "--lights", path("no.json"), "-o", path("x.csv")}, "no.json");
  expect_refused({"solve", file, "--lights", kScene, "-o", path("x.csv")}, "KHR_lights_punctual");
  expect_refused({"solve", file, "-o", nowhere + ".csv"}, "create the folder");
  expect_refused({"solve", file, "-o", nowhere + ".npz"}, "create the folder");
  expect_refused({"export", file, "--what", "mesh", "-o", nowhere + ".npz"}, "create the folder");
  expect_refused({"render", file, "-o", nowhere + ".png"}, "create the folder");
  expect_refused({"render", file, "--size", "0x9", "-o", path("x.png")}, "WIDTHxHEIGHT");
  expect_refused({"render", file, "--size", "640", "-o", path("x.png")}, "WIDTHxHEIGHT");
  expect_refused({"render", file, "--camera", "7", "-o", path("x.png")}, "camera");
  expect_refused({"render", file, "--camera", "1,2,3,4,5,x", "-o", path("x.png")}, "camera");
}

TEST_F(CommandLine, RefusesADamagedFile) {
  std::string bytes = test::read_bytes(built("box.safetensors"));
  bytes[bytes.size() / 2] ^= 1;
  expect_refused({"info", write("box.safetensors", bytes)}, "checksum");
  bytes.resize(bytes.size() / 2);
  expect_refused({"info", write("box.safetensors", bytes)}, "box.safetensors");
}

TEST_F(CommandLine, SaysWhatScriptsRelyOn) {
  const std::string file = path("box.safetensors");
  const Words info_keys = {"format_version", "scene_hash",      "patch_count", "operator",
                           "operator_bytes", "bytes_per_patch", "tolerance",   "error_mean",
                           "error_max",      "error_bound"};
  const json made = summary_of(
      test::quick({"precompute", kScene, "--patches", "300", "--store-form-factors", "-o", file}));
  const json info = summary_of({"info", file});
  for (const std::string& key : info_keys) {
    EXPECT_TRUE(info.contains(key)) << key;
    EXPECT_EQ(made.value(key, json()), info.value(key, json(0))) << key;
  }
  for (const char* key : {"seconds", "rays", "peak_memory_bytes", "report"}) {
    EXPECT_TRUE(made.contains(key)) << key;
  }
  EXPECT_NEAR(info["patch_count"].get<double>(), kPatchCount, 0.2 * kPatchCount);
  EXPECT_EQ(info["operator"], "hierarchical");
  EXPECT_EQ(info["form_factors"], "pairs");
  EXPECT_EQ(info["file_bytes"], test::read_bytes(file).size());
  EXPECT_GT(made["seconds"]["total"].get<double>(), 0);
  EXPECT_EQ(info["tolerance"], kDefaultTolerance);
  EXPECT_EQ(info["settings"]["tolerance"], kDefaultTolerance);
  EXPECT_LE(info["error_mean"].get<double>(), kDefaultTolerance);

  const json solved = summary_of({"solve", file, "-o", path("x.csv"), "--method", "gauss-seidel"});
  EXPECT_EQ(solved["method"], "gauss-seidel");
  EXPECT_GT(solved["sweeps"].get<int>(), 1);
  EXPECT_LT(solved["residual"].get<double>(), 1e-6);
  EXPECT_GT(solved["microseconds"].get<double>(), 0);
}

TEST_F(CommandLine, DrawsWhateverIsAskedFor) {
  const std::string file = built("box.safetensors", {"--store-form-factors"});
  for (const char* show : {"direct", "indirect", "radiosity", "patches", "error"}) {
    const json drawn = summary_of({"render", file, "--lights", kLights, "--size", "64x48", "--show",
                                   show, "-o", path("x.png")});
    EXPECT_EQ(drawn["width"], 64) << show;
    const std::string png = test::read_bytes(path("x.png"));
    ASSERT_GT(png.size(), 64U) << show;
    EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n") << show;
    EXPECT_EQ(png[19], 64) << show;
    EXPECT_EQ(png[23], 48) << show;
    std::filesystem::remove(folder_ / "x.png");
  }
}

TEST_F(CommandLine, TheShippedScenesAreWhatTheirScriptsMake) {
  // ./dev test installs it; the scenes are shipped, so that nothing else needs it.
  if (std::system("python3 --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs python3";
  const std::string command =
      "python3 '" + kScenes + "make_cornell_box.py' '" + path("box.gltf") + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(test::read_bytes(path("box.gltf")), test::read_bytes(kScene));
  for (const std::string script : {"make_rooms.py", "make_house.py"}) {
    ASSERT_EQ(std::system(("python3 '" + kScenes + script + "' '" + path(".") + "'").c_str()), 0);
  }
  for (const std::string name : {"two_rooms", "three_rooms", "furnished_room", "furnished_house",
                                 "white_room", "pavilion"}) {
    const std::string file = name + ".gltf";
    EXPECT_EQ(test::read_bytes(path(file)), test::read_bytes(kScenes + file)) << name;
  }
}

}  // namespace
}  // namespace rebounce::test_command_line

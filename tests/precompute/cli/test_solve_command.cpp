// `rebounce solve` as scripts see it: methods, lights, tables.

#include <gtest/gtest.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "runtime/solvers/solve_radiosity.h"
#include "tests/precompute/cli/solution_table.h"
#include "tests/support/command_line.h"
#include "tests/support/npz_reader.h"

namespace rebounce::test_solve_command {
namespace {

using nlohmann::json;
using test::difference;
using test::kLights;
using test::kPatchCount;
using test::kScene;
using test::kScenes;
using test::read_csv;
using test::Table;
using test::Words;
using SolveCommand = test::CommandLine;

const Words kSetups = {"own_lamp", "ceiling_point", "coloured_pair", "spot_on_red_wall"};

TEST_F(SolveCommand, IteratesOnCompressedFormFactors) {
  const std::string file = path("box.safetensors");
  const json info =
      summary_of(test::quick({"precompute", kScene, "--patches", "1200", "--compress-form-factors",
                              "0.002", "--store-form-factors", "-o", file}));
  EXPECT_GT(info["compressed_form_factor_bytes"].get<double>(), 0);
  EXPECT_LT(info["report"]["form_factor_error_mean"].get<double>(), 0.002);
  const std::string exact = path("exact.csv"), compressed = path("compressed.csv");
  summary_of({"solve", file, "-o", exact, "--method", "gauss-seidel"});
  const json solved = summary_of({"solve", file, "-o", compressed, "--method",
                                  "symmetric-gauss-seidel", "--form-factors", "compressed"});
  EXPECT_EQ(solved["form_factors"], "compressed");
  EXPECT_LT(solved["residual"].get<double>(), 1e-6);
  EXPECT_LT(difference(read_csv(exact), read_csv(compressed), 3), 0.01);
}

TEST_F(SolveCommand, CompressedFormFactorsMustBeThere) {
  expect_refused({"solve", built("box.safetensors"), "-o", path("x.csv"), "--method", "gathering",
                  "--form-factors", "compressed"},
                 "--compress-form-factors");
}

TEST_F(SolveCommand, SolvesTheSameByEitherMethod) {
  const std::string file =
      built("box.safetensors", {"--operator", "dense", "--store-form-factors"});
  const std::string exact = path("transfer.csv"), iterated = path("gauss-seidel.csv");
  for (const std::string& setup : kSetups) {
    const std::string lights = kScenes + setup + ".lights.json";
    summary_of({"solve", file, "--lights", lights, "-o", exact});
    summary_of({"solve", file, "--lights", lights, "-o", iterated, "--method", "gauss-seidel",
                "--residual", "1e-7"});
    const Table a = read_csv(exact), b = read_csv(iterated);
    ASSERT_EQ(a.names,
              (Words{"direct_irradiance_r", "direct_irradiance_g", "direct_irradiance_b",
                     "indirect_irradiance_r", "indirect_irradiance_g", "indirect_irradiance_b",
                     "radiosity_r", "radiosity_g", "radiosity_b"}));
    ASSERT_EQ(a.names, b.names);
    ASSERT_NEAR(static_cast<double>(a.rows.size()), kPatchCount, 0.2 * kPatchCount);
    ASSERT_EQ(a.rows.size(), b.rows.size());
    EXPECT_LT(difference(a, b, 3), 1e-4) << setup;
    EXPECT_LT(difference(a, b, 6), 1e-4) << setup;
  }
}

TEST_F(SolveCommand, SaysHowMuchLightThereIsAndWhatEachStageTakes) {
  const std::string file = built("box.safetensors");
  const Words words = {"solve", file, "--lights", kLights, "-o", path("x.csv")};
  const json solved = summary_of(words);
  summary_of({"export", file, "--what", "patches", "-o", path("patches.npz")});
  const auto area = test::npz_values<float>(test::unzip(path("patches.npz")), "area", "<f4");
  const Table table = read_csv(path("x.csv"));
  ASSERT_EQ(table.rows.size(), area.size());
  double direct = 0, indirect = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const auto lux = [&](std::size_t first) {
      return 0.2126 * table.rows[i][first] + 0.7152 * table.rows[i][first + 1] +
             0.0722 * table.rows[i][first + 2];
    };
    direct += area[i] * lux(0);
    indirect += area[i] * lux(3);
  }
  EXPECT_NEAR(solved["lumens"]["direct"].get<double>(), direct, 1e-4 * direct);
  EXPECT_NEAR(solved["lumens"]["indirect"].get<double>(), indirect, 1e-4 * indirect);
  EXPECT_GT(solved["lumens"]["emitted"], 0);
  EXPECT_GT(solved["direct_microseconds"], 0);
  const std::string said = run(words).out;
  for (const char* part : {" lm directly from lamps and sky, ", " lm emitted by surfaces, ",
                           " lm indirectly\ndirect light ", "indirect light by transfer "}) {
    EXPECT_NE(said.find(part), std::string::npos) << said;
  }
  const json drawn =
      summary_of({"render", file, "--lights", kLights, "--size", "16x9", "-o", path("x.png")});
  EXPECT_EQ(drawn["lumens"], solved["lumens"]);
  EXPECT_GT(drawn["microseconds"]["direct"], 0);
  EXPECT_GT(drawn["microseconds"]["product"], 0);
}

TEST_F(SolveCommand, SaysTheErrorOfItsFrameWhereThereAreFormFactors) {
  const auto solved = [&](const std::string& file) {
    return summary_of({"solve", file, "--lights", kLights, "-o", path("x.csv")});
  };
  const json with = solved(built("with.safetensors", {"--store-form-factors"}));
  EXPECT_GT(with["error_estimate"].get<double>(), 1e-5);
  EXPECT_LT(with["error_estimate"].get<double>(), 0.02);
  EXPECT_GE(with["error_bound"].get<double>(), with["error_estimate"].get<double>());
  EXPECT_LT(with["error_bound"].get<double>(), 0.1);
  const json without = solved(built("without.safetensors"));
  EXPECT_TRUE(without["error_estimate"].is_null());
  EXPECT_TRUE(without["error_bound"].is_null());
}

TEST_F(SolveCommand, EveryMethodReachesTheResidualItWasAsked) {
  const std::string file = built("box.safetensors", {"--store-form-factors"});
  for (const NamedSolveMethod& method : kSolveMethods) {
    const std::string name(method.name);
    const json solved = summary_of({"solve", file, "--lights", kLights, "-o", path("x.csv"),
                                    "--method", name, "--residual", "1e-5"});
    EXPECT_EQ(solved["method"], name);
    EXPECT_GE(solved["sweeps"].get<int>(), 1) << name;
    EXPECT_LE(solved["residual"].get<double>(), 1e-5) << name;
    const json hurried =
        summary_of({"solve", file, "--lights", kLights, "-o", path("x.csv"), "--method", name,
                    "--residual", "0", "--iterations", "1000000", "--time-budget", "500"});
    EXPECT_LT(hurried["sweeps"].get<int>(), 1000000) << name;
  }
}

TEST_F(SolveCommand, SolvesHierarchicallyWhereThereAreLinks) {
  const std::string file = built("box.safetensors", {"--store-links", "--store-form-factors"});
  const std::string flat = path("flat.csv"), linked = path("linked.csv");
  summary_of({"solve", file, "--lights", kLights, "-o", flat, "--method", "gauss-seidel"});
  const json solved =
      summary_of({"solve", file, "--lights", kLights, "-o", linked, "--method", "hierarchical"});
  EXPECT_EQ(solved["method"], "hierarchical");
  EXPECT_EQ(solved["form_factors"], "links");
  EXPECT_LT(difference(read_csv(flat), read_csv(linked), 6), 0.05);

  const std::string without = built("pairs.safetensors");
  expect_refused(
      {"solve", without, "--lights", kLights, "-o", path("x.csv"), "--method", "hierarchical"},
      "--store-links");
}

TEST_F(SolveCommand, GathersAlongLinksWithAnyMethodThatGathers) {
  const std::string file = built("box.safetensors", {"--store-links"});
  const auto solve = [&](const std::string& method, const std::string& name) {
    return std::vector<std::string>{"solve",    file,       "--lights", kLights,          "-o",
                                    path(name), "--method", method,     "--form-factors", "links"};
  };
  const json jacobi = summary_of(solve("hierarchical", "jacobi.csv"));
  const json conjugate = summary_of(solve("conjugate-gradient", "conjugate.csv"));
  EXPECT_EQ(conjugate["form_factors"], "links");
  EXPECT_LT(conjugate["sweeps"], jacobi["sweeps"]);
  EXPECT_LT(difference(read_csv(path("jacobi.csv")), read_csv(path("conjugate.csv")), 6), 1e-3);
  expect_refused(solve("gauss-seidel", "x.csv"), "gather");
}

TEST_F(SolveCommand, WritesTheSameSolutionAsCsvAndNpz) {
  const std::string file = built("box.safetensors");
  summary_of({"solve", file, "--lights", kLights, "-o", path("a.csv")});
  summary_of({"solve", file, "--lights", kLights, "-o", path("a.npz")});
  const Table table = read_csv(path("a.csv"));
  const auto arrays = test::unzip(path("a.npz"));
  ASSERT_EQ(arrays.size(), 3U);
  const std::string names[] = {"direct_irradiance", "indirect_irradiance", "radiosity"};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto values = test::npz_values<float>(arrays, names[k], "<f4");
    ASSERT_EQ(values.size(), 3 * table.rows.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(values[i], static_cast<float>(table.rows[i / 3][3 * k + i % 3]));
    }
  }
}

TEST_F(SolveCommand, RefusesAMalformedLightFileWithTheField) {
  const std::string file = built("box.safetensors");
  const std::pair<std::string, std::string> cases[] = {
      {"", "is truncated: it ends at byte 0"},
      {R"({"lights": [{"intensity")", "is truncated: it ends at byte 24"},
      {R"({"lights": [{"intensity": 1 2}]})", "is not JSON: parse error at line 1, column 29"},
      {"[]", "\"lights\""},
      {R"({"lamps": []})", "\"lamps\""},
      {R"({"lights": {}})", "\"lights\""},
      {R"({"lights": [7]})", "light 0"},
      {R"({"lights": [{}, {"colour": [1, 1, 1]}]})", "light 1: unknown field \"colour\""},
      {R"({"lights": [{"type": "area"}]})", "\"type\""},
      {R"({"lights": [{"type": 3}]})", "\"type\""},
      {R"({"lights": [{"name": 3}]})", "\"name\""},
      {R"({"lights": [{"position": [1, 2]}]})", "\"position\""},
      {R"({"lights": [{"position": [1, 2, "3"]}]})", "\"position\""},
      {R"({"lights": [{"position": [1, 2, 1e300]}]})",
       "\"position\" must be three numbers of at most 3.4e+38; it is [1,2,1e+300]"},
      {R"({"lights": [{"direction": [0, 0, 0]}]})", "\"direction\""},
      {R"({"lights": [{"color": [1, -1, 1]}]})", "\"color\""},
      {R"({"lights": [{"color": 1}]})", "\"color\""},
      {R"({"lights": [{"intensity": -5}]})", "\"intensity\""},
      {R"({"lights": [{"intensity": 1e39}]})",
       "\"intensity\" must be a number of at most 3.4e+38; it is 1e+39"},
      {R"({"lights": [{"intensity": "bright"}]})",
       "\"intensity\" must be a number, at least 0; it is \"bright\""},
      {R"({"lights": [{"range": -1}]})", "\"range\""},
      {R"({"lights": [{"spot": 1}]})", "\"spot\""},
      {R"({"lights": [{"spot": {"angle": 1}}]})", "\"angle\""},
      {R"({"lights": [{"spot": {"outerConeAngle": 2}}]})", "\"outerConeAngle\""},
      {R"({"lights": [{"spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.5}}]})",
       "\"innerConeAngle\""},
      {R"({"lights": [{"type": "sphere"}]})", "\"radius\""},
      {R"({"lights": [{"type": "sphere", "radius": 0}]})", "\"radius\""},
      {R"({"lights": [{"radius": 1}]})", "\"radius\""},
      {R"({"lights": [{"type": "rectangle", "width": 1}]})", "\"height\""},
      {R"({"lights": [{"type": "rectangle", "width": 1, "height": 1, "tangent": [0, 2, 0]}]})",
       "\"tangent\""},
      {R"({"lights": [{"tangent": [1, 0, 0]}]})", "\"tangent\""},
      {R"({"lights": [{"type": "sphere", "radius": 1, "ies": "x"}]})", "\"ies\""},
      {R"({"lights": [{"ies": 1}]})", "\"ies\""},
      {R"({"lights": [{"ies": "none.ies"}]})", "none.ies"},
      {R"({"lights": [{"ies": "/dev/zero"}]})", "cannot open /dev/zero"},
      {R"({"lights": [{"ies": "bad.lights.json"}]})", "TILT="},
      {R"({"emitters": 1})", "\"emitters\""},
      {R"({"emitters": [{"scale": 1}]})", "\"material\""},
      {R"({"emitters": [{"material": "lamp", "scale": -1}]})", "\"scale\""},
      {R"({"emitters": [{"material": "no such"}]})", "no such"},
      {R"({"sky": 1})", "\"sky\""},
      {R"({"sky": {"luminance": -1}})", "\"luminance\""},
      {R"({"sky": {"color": [1]}})", "\"color\""},
      {R"({"sky": {"cie": 16}})", "\"cie\""},
      {R"({"sky": {"cie": 12, "sunDirection": [0, 1, 0]}})", "above the horizon"},
      {R"({"sky": {"cells": [1, 2]}})", "146 numbers"},
      {R"({"sky": {"sunDirection": [0, -1, 0]}})", "with \"cie\" only"},
      {R"({"lights": [{"type": "disc"}]})", "\"radius\""},
      {R"({"sky": {"intensity": 1}})", "\"intensity\""},
  };
  for (const auto& [text, field] : cases) {
    const std::string lights = write("bad.lights.json", text);
    expect_refused({"solve", file, "--lights", lights, "-o", path("x.csv")}, field);
  }
}

TEST_F(SolveCommand, WarnsOfALampThatLightsNothing) {
  const std::string file = built("box.safetensors");
  const std::string lights = write("far.lights.json", R"({"lights": [{"position": [0.3, 0.4, 0.3]},
      {"name": "cellar", "position": [0.3, -3, 0.3]}]})");
  const Words solve = {"solve", file, "--lights", lights, "-o", path("x.csv")};
  const test::Outcome outcome = run(solve);
  EXPECT_EQ(outcome.exit_code, test::kDone);
  EXPECT_EQ(outcome.err,
            "warning: light 1 \"cellar\" (point) lights nothing: check its position, direction and "
            "range\n");
}

TEST_F(SolveCommand, SaysWhatToDoWhereThereIsNoLight) {
  const std::string file = path("dark.safetensors");
  summary_of(
      test::quick({"precompute", kScenes + "two_rooms.gltf", "--patches", "60", "-o", file}));
  expect_refused({"solve", file, "-o", path("x.csv")}, "name a file with --lights");
  const std::string none = write("none.lights.json", R"({"lights": []})");
  expect_refused({"solve", file, "--lights", none, "-o", path("x.csv")},
                 "none.lights.json has no lights and no sky");
  expect_refused({"render", file, "--lights", none, "-o", path("x.png")}, "render --key-light");
}

TEST_F(SolveCommand, TakesEveryKindOfLight) {
  const std::string file = built("box.safetensors");
  const std::string profile = "IESNA91\nTILT=NONE\n1 1 1 2 1 1 1 0 0 0\n1 1 1\n0 90\n0\n100 0\n";
  write("lamp.ies", profile);
  const auto irradiance = [&](const std::string& text) {
    const std::string lights = write("kind.lights.json", text);
    summary_of({"solve", file, "--lights", lights, "-o", path("kind.npz")});
    const auto arrays = test::unzip(path("kind.npz"));
    double sum = 0;
    for (const float e : test::npz_values<float>(arrays, "radiosity", "<f4")) sum += e;
    return sum;
  };
  const double lamp = irradiance(R"({"lights": []})");  // the scene's own
  EXPECT_NEAR(irradiance(R"({"emitters": [{"material": "lamp", "scale": 0.5}]})") / lamp, 0.5,
              1e-4);
  const std::string off = R"("emitters": [{"material": "lamp", "scale": 0}])";
  for (const char* light :
       {R"({"type": "sphere", "position": [0.28, 0.4, 0.28], "radius": 0.02})",
        R"({"type": "rectangle", "position": [0.28, 0.5, 0.28], "width": 0.1, "height": 0.1})",
        R"({"position": [0.28, 0.5, 0.28], "ies": "lamp.ies", "tangent": [0, 0, 1]})"}) {
    const std::string one = std::string(R"({"lights": [)") + light + "], " + off + "}";
    EXPECT_GT(irradiance(one), 0) << light;
  }
}

/// The shipped scene with a point light of its own.
json scene_with_light() {
  json scene = json::parse(test::read_bytes(kScene));
  scene["extensionsUsed"].push_back("KHR_lights_punctual");
  scene["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"color", {1, 0.95, 0.88}}, {"intensity", 20}}};
  const json reference = {{"light", 0}};
  scene["scenes"][0]["nodes"].push_back(scene["nodes"].size());
  scene["nodes"].push_back(
      {{"translation", {0.278, 0.47, 0.28}}, {"extensions", {{"KHR_lights_punctual", reference}}}});
  return scene;
}

/// A binary glTF file with one chunk, the JSON.
std::string glb(const json& document) {
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto little_endian = [](std::uint32_t value) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(value >> (8 * i)));
    return bytes;
  };
  const auto length = static_cast<std::uint32_t>(text.size());
  return "glTF" + little_endian(2) + little_endian(20 + length) + little_endian(length) + "JSON" +
         text;
}

TEST_F(SolveCommand, TakesLightsFromAGlb) {
  const std::string file = built("box.safetensors");
  const std::string scene = write("lit.glb", glb(scene_with_light()));
  summary_of({"solve", file, "--lights", scene, "-o", path("glb.csv")});
  summary_of({"solve", file, "--lights", kLights, "-o", path("json.csv")});
  EXPECT_EQ(test::read_bytes(path("glb.csv")), test::read_bytes(path("json.csv")));

  const std::string lit = path("lit.safetensors");
  summary_of(test::quick({"precompute", scene, "--patches", "300", "-o", lit}));
  summary_of({"solve", lit, "-o", path("own.csv")});
  summary_of({"solve", lit, "--lights", kLights, "-o", path("given.csv")});
  EXPECT_EQ(test::read_bytes(path("own.csv")), test::read_bytes(path("given.csv")));
}

TEST_F(SolveCommand, RefusesToRelightWithoutAnyLight) {
  json dark = json::parse(test::read_bytes(kScene));
  for (json& material : dark["materials"]) material.erase("emissiveFactor");
  summary_of(test::quick({"precompute", write("dark.gltf", dark.dump()), "--patches", "300", "-o",
                          path("dark.safetensors")}));
  expect_refused({"solve", path("dark.safetensors"), "-o", path("x.csv")}, "--lights");
  // A picture may have a lamp of its own.
  summary_of(
      {"render", path("dark.safetensors"), "--key-light", "--size", "32x24", "-o", path("x.png")});
}

}  // namespace
}  // namespace rebounce::test_solve_command

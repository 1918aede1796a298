// The program `rebounce` as scripts see it: exit status, what it prints where, what it writes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "precompute/compression/hierarchical_settings.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/command_line.h"
#include "tests/support/npz_reader.h"

namespace rebounce {
namespace {

using nlohmann::json;
using test::CommandLine;
using test::is_one_line;
using test::kBadInput;
using test::kDone;
using test::kLights;
using test::kPatchCount;
using test::kScene;
using test::kScenes;
using test::kUsage;
using test::Names;
using test::Outcome;
using test::Words;

const Words kSetups = {"own_lamp", "ceiling_point", "coloured_pair", "spot_on_red_wall"};

/// A table of numbers under a line of names.
struct Table {
  Words names;
  std::vector<std::vector<double>> rows;
};

Table read_csv(const std::string& path) {
  std::istringstream lines(test::read_bytes(path));
  Table table;
  std::string line, cell;
  std::getline(lines, line);
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) table.names.push_back(cell);
  while (std::getline(lines, line)) {
    std::vector<double>& row = table.rows.emplace_back();
    for (std::istringstream cells(line); std::getline(cells, cell, ',');) {
      row.push_back(std::stod(cell));
    }
  }
  return table;
}

/// Largest difference in columns [first, first + 3), as a part of the largest value there.
double difference(const Table& a, const Table& b, std::size_t first) {
  double largest = 0, apart = 0;
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    for (std::size_t c = first; c < first + 3; ++c) {
      largest = std::max(largest, a.rows[i].at(c));
      apart = std::max(apart, std::abs(a.rows[i].at(c) - b.rows[i].at(c)));
    }
  }
  EXPECT_GT(largest, 0);
  return apart / largest;
}

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
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, kUsage) << outcome.err;
    EXPECT_EQ(outcome.out, "") << part;
    EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("rebounce: ")) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err << "lacks " << part;
  }
  EXPECT_EQ(folder_.names(), Names{});
}

TEST_F(CommandLine, RefusesBadInputInOneLine) {
  const std::string file = precompute("box.safetensors");
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
  std::string bytes = test::read_bytes(precompute("box.safetensors"));
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
  const json made =
      summary_of({"precompute", kScene, "--patches", "300", "--store-form-factors", "-o", file});
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

TEST_F(CommandLine, HoldsWhatARunNeedsAndFormFactorsOnRequest) {
  const std::string file = precompute("box.safetensors");
  const std::string whole = precompute("whole.safetensors", {"--store-form-factors"});
  EXPECT_LT(test::read_bytes(file).size(), test::read_bytes(whole).size() * 3 / 4);
  EXPECT_EQ(summary_of({"info", file})["form_factors"], "none");
  const Outcome printed = run({"info", file});
  EXPECT_NE(printed.out.find("--store-form-factors"), std::string::npos) << printed.out;

  const auto solve = [&](const std::string& from, const std::string& method) {
    return Words{"solve", from, "--lights", kLights, "-o", path("x.csv"), "--method", method};
  };
  const json product = summary_of(solve(file, "transfer"));
  EXPECT_TRUE(product["residual"].is_null());
  EXPECT_EQ(product["form_factors"], "none");
  EXPECT_EQ(product["method"], "transfer");
  EXPECT_EQ(product["sweeps"], 0);
  EXPECT_GT(product["microseconds"], 0);
  const std::string without = test::read_bytes(path("x.csv"));
  EXPECT_LT(summary_of(solve(whole, "transfer"))["residual"], 2 * kDefaultTolerance);
  EXPECT_EQ(without, test::read_bytes(path("x.csv")));
  const Outcome said = run(solve(file, "transfer"));
  EXPECT_NE(said.out.find("--store-form-factors"), std::string::npos) << said.out;

  std::filesystem::remove(folder_ / "x.csv");
  for (const NamedSolveMethod& method : kSolveMethods) {
    expect_refused(solve(file, std::string(method.name)), "--store-form-factors");
  }
  Words exact = solve(file, "gathering");
  exact.insert(exact.end(), {"--form-factors", "exact"});
  expect_refused(exact, "--store-form-factors");
  expect_refused({"export", file, "--what", "form-factors", "-o", path("f.npz")},
                 "--store-form-factors");
  const auto draw = [&](const std::string& from, const char* show, const char* picture) {
    return Words{"render", from,     "--lights", kLights, "--size",
                 "32x24",  "--show", show,       "-o",    path(picture)};
  };
  expect_refused(draw(file, "error", "x.png"), "--store-form-factors");
  // The light that comes straight from the scene's own lamp.
  for (const char* show : {"direct", "indirect"}) {
    summary_of(draw(file, show, "without.png"));
    summary_of(draw(whole, show, "with.png"));
    EXPECT_EQ(test::read_bytes(path("without.png")), test::read_bytes(path("with.png"))) << show;
  }
}

TEST_F(CommandLine, LinksHaveNoFormFactorsOfPairs) {
  expect_refused({"precompute", kScene, "--patches", "100", "--form-factors", "links",
                  "--store-form-factors", "-o", path("x.safetensors")},
                 "--compress-form-factors");
  const std::string file = precompute("box.safetensors", {"--form-factors", "links"});
  const json info = summary_of({"info", file});
  EXPECT_EQ(info["form_factors"], "none");
  EXPECT_EQ(info["compressed_form_factor_bytes"], 0);
  EXPECT_EQ(info["settings"]["form_factor_tolerance"], kDefaultTolerance / 5);
  EXPECT_LE(info["error_mean"].get<double>(), kDefaultTolerance);
}

TEST_F(CommandLine, RecordsTheSettingsThatApply) {
  const json dense = summary_of({"info", precompute("dense", {"--operator", "dense"})});
  EXPECT_EQ(dense["operator"], "dense");
  EXPECT_EQ(dense["tolerance"], 0);
  EXPECT_FALSE(dense["settings"].contains("tolerance"));
  EXPECT_FALSE(dense["settings"].contains("rank"));
  EXPECT_LT(dense["error_max"].get<double>(), 1e-5);
}

TEST_F(CommandLine, CompressesToATolerance) {
  const Words words = {"precompute",  kScene, "--patches", "1200",
                       "--tolerance", "0.02", "-o",        path("box.safetensors")};
  const json info = summary_of(words);
  EXPECT_EQ(info["operator"], "hierarchical");
  EXPECT_EQ(info["tolerance"], 0.02);
  EXPECT_LT(info["error_mean"].get<double>(), 0.02);
  EXPECT_GT(info["error_mean"].get<double>(), 1e-4);
  EXPECT_LT(info["bytes_per_patch"].get<double>(), 1000);  // dense: 7,200
  summary_of({"export", path("box.safetensors"), "--what", "transfer", "-o", path("y.npz")});
  const auto arrays = test::unzip(path("y.npz"));
  const auto n = info["patch_count"].get<std::size_t>();
  EXPECT_EQ(test::npz_values<float>(arrays, "transfer", "<f4").size(), 3 * n * n);
}

TEST_F(CommandLine, IteratesOnCompressedFormFactors) {
  const std::string file = path("box.safetensors");
  const json info =
      summary_of({"precompute", kScene, "--patches", "1200", "--compress-form-factors", "0.002",
                  "--store-form-factors", "-o", file});
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

TEST_F(CommandLine, CompressedFormFactorsMustBeThere) {
  const Outcome outcome = run({"solve", precompute("box.safetensors"), "-o", path("x.csv"),
                               "--method", "gathering", "--form-factors", "compressed"});
  EXPECT_EQ(outcome.exit_code, kBadInput);
  EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
  EXPECT_NE(outcome.err.find("--compress-form-factors"), std::string::npos) << outcome.err;
}

TEST_F(CommandLine, AMissedToleranceFails) {
  // Half precision cannot be this exact.
  const Outcome outcome =
      run({"precompute", kScene, "--patches", "300", "--operator", "hierarchical", "--tolerance",
           "0.00001", "-o", path("box.safetensors"), "--quiet"});
  EXPECT_EQ(outcome.exit_code, kBadInput);
  EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
  EXPECT_NE(outcome.err.find("misses its tolerance"), std::string::npos) << outcome.err;
  EXPECT_GT(summary_of({"info", path("box.safetensors")})["error_mean"].get<double>(), 1e-5);
}

TEST_F(CommandLine, FormFactorsThatMissTheirToleranceFail) {
  const Outcome outcome = run({"precompute", kScene, "--patches", "300", "--compress-form-factors",
                               "0.00001", "-o", path("box.safetensors"), "--quiet"});
  EXPECT_EQ(outcome.exit_code, kBadInput);
  EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
  EXPECT_NE(outcome.err.find("miss their tolerance"), std::string::npos) << outcome.err;
  const json report = summary_of({"info", path("box.safetensors")})["report"];
  EXPECT_GT(report["form_factor_error_mean"].get<double>(), 1e-5);
}

TEST_F(CommandLine, IntegersAreRefusedBeforeAnythingIsComputed) {
  for (const std::string kind : {"dense", "low-rank"}) {
    for (const std::string precision : {"q16", "q8"}) {
      const Outcome outcome = run({"precompute", kScene, "--patches", "300", "--operator", kind,
                                   "--precision", precision, "-o", path("box.safetensors")});
      EXPECT_EQ(outcome.exit_code, kBadInput);
      // The estimate, which comes before the form factors, would be a line of its own.
      EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
      EXPECT_NE(outcome.err.find("hierarchical"), std::string::npos) << outcome.err;
    }
  }
}

TEST_F(CommandLine, RelightsByOperatorsOfLowRank) {
  const std::string exact = path("exact.csv"), nearly = path("nearly.csv");
  summary_of({"solve", precompute("dense.safetensors", {"--operator", "dense"}), "-o", exact});
  const std::string file = precompute("low-rank", {"--operator", "low-rank", "--rank", "64"});
  const json info = summary_of({"info", file});
  EXPECT_EQ(info["operator"], "low-rank");
  EXPECT_EQ(info["tolerance"], 0);
  EXPECT_EQ(info["settings"]["rank"], 64);
  EXPECT_GT(info["error_mean"].get<double>(), 1e-4);
  EXPECT_GT(info["error_bound"].get<double>(), info["error_max"].get<double>());
  summary_of({"solve", file, "-o", nearly});
  // The largest difference at a patch: that of the corners.
  EXPECT_LT(difference(read_csv(exact), read_csv(nearly), 3), 0.7);
}

TEST_F(CommandLine, MeetsThePatchSize) {
  const json made = summary_of(
      {"precompute", kScene, "--patch-size", "0.1", "-o", path("box.safetensors"), "--quiet"});
  // The surfaces measure 2.1 m2; the largest patch of that length is a square, the smallest a right
  // triangle half as long.
  EXPECT_GT(made["patch_count"].get<int>(), 2.1 / 0.005);
  EXPECT_LT(made["patch_count"].get<int>(), 2.1 / 0.000625);
}

TEST_F(CommandLine, SolvesTheSameByEitherMethod) {
  const std::string file =
      precompute("box.safetensors", {"--operator", "dense", "--store-form-factors"});
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

TEST_F(CommandLine, EveryMethodReachesTheResidualItWasAsked) {
  const std::string file = precompute("box.safetensors", {"--store-form-factors"});
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

TEST_F(CommandLine, WorksWithoutPairs) {
  const std::string file = path("box.safetensors");
  const json built = summary_of({"precompute", kScene, "--patches", "400", "--form-factors",
                                 "links", "--tolerance", "0.02", "--store-links",
                                 "--compress-form-factors", "0.004", "-o", file});
  EXPECT_EQ(built["form_factors"], "compressed");
  EXPECT_EQ(built["form_factor_count"], 0);
  EXPECT_GT(built["link_count"], 0);
  EXPECT_EQ(built["settings"]["form_factors"], "links");
  const json info = summary_of({"info", file});
  EXPECT_EQ(info["operator"], "hierarchical");
  EXPECT_GT(info["error_mean"], 0);
  EXPECT_LT(info["error_mean"], 0.02);
  EXPECT_GT(info["form_factor_error_mean"], 0);
  EXPECT_LT(info["form_factor_error_mean"], 0.004);

  const std::string once = path("once.csv");
  summary_of({"solve", file, "--lights", kLights, "-o", once});
  for (const std::string method : {"gathering", "jacobi", "gauss-seidel", "symmetric-gauss-seidel",
                                   "conjugate-gradient", "refine", "hierarchical"}) {
    const json solved = summary_of({"solve", file, "--lights", kLights, "-o", path("x.csv"),
                                    "--method", method, "--residual", "1e-5"});
    EXPECT_EQ(solved["form_factors"], method == "hierarchical" ? "links" : "compressed") << method;
    EXPECT_LT(difference(read_csv(once), read_csv(path("x.csv")), 6), 0.1) << method;
  }
  const auto solve = [&](const char* option, const char* value) {
    return Words{"solve", file, "--lights", kLights, "-o", path("y.csv"), option, value};
  };
  expect_refused(solve("--form-factors", "exact"), "--store-form-factors");
  expect_refused({"export", file, "--what", "form-factors", "-o", path("x.npz")},
                 "--form-factors pairs --store-form-factors");
  for (const std::string show : {"radiosity", "error"}) {
    summary_of({"render", file, "--lights", kLights, "--size", "32x24", "--show", show, "-o",
                path("x.png")});
  }
}

TEST_F(CommandLine, LinksMakeHierarchicalOperatorsOnly) {
  for (const std::string kind : {"dense", "low-rank"}) {
    expect_refused({"precompute", kScene, "--patches", "100", "--form-factors", "links",
                    "--operator", kind, "-o", path("x.safetensors")},
                   "only a hierarchical operator");
  }
}

TEST_F(CommandLine, PairsHaveNoErrorOfALink) {
  expect_refused({"precompute", kScene, "--patches", "100", "--link-epsilon", "0.001", "-o",
                  path("x.safetensors")},
                 "from links");
}

TEST_F(CommandLine, QualitySetsTheRaysOfFormFactors) {
  const json low = summary_of({"info", precompute("low.safetensors", {"--quality", "low"})});
  const json usual = summary_of({"info", precompute("usual.safetensors")});
  EXPECT_EQ(low["settings"]["hemisphere_rays"], 1024);
  EXPECT_EQ(low["settings"]["full_rays"], 16);
  EXPECT_EQ(usual["settings"]["hemisphere_rays"], 4096);
}

TEST_F(CommandLine, SolvesHierarchicallyWhereThereAreLinks) {
  const std::string file = precompute("box.safetensors", {"--store-links", "--store-form-factors"});
  const std::string flat = path("flat.csv"), linked = path("linked.csv");
  summary_of({"solve", file, "--lights", kLights, "-o", flat, "--method", "gauss-seidel"});
  const json solved =
      summary_of({"solve", file, "--lights", kLights, "-o", linked, "--method", "hierarchical"});
  EXPECT_EQ(solved["method"], "hierarchical");
  EXPECT_EQ(solved["form_factors"], "links");
  EXPECT_LT(difference(read_csv(flat), read_csv(linked), 6), 0.05);

  const std::string without = precompute("pairs.safetensors");
  expect_refused(
      {"solve", without, "--lights", kLights, "-o", path("x.csv"), "--method", "hierarchical"},
      "--store-links");
}

TEST_F(CommandLine, GathersAlongLinksWithAnyMethodThatGathers) {
  const std::string file = precompute("box.safetensors", {"--store-links"});
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

TEST_F(CommandLine, WritesTheSameSolutionAsCsvAndNpz) {
  const std::string file = precompute("box.safetensors");
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

TEST_F(CommandLine, ExportsReciprocalFormFactors) {
  summary_of({"export", precompute("box.safetensors", {"--store-form-factors"}), "--what",
              "form-factors", "-o", path("f.npz")});
  const auto arrays = test::unzip(path("f.npz"));
  const auto form_factor = test::npz_values<double>(arrays, "form_factor", "<f8");
  const auto area = test::npz_values<float>(arrays, "area", "<f4");
  const std::size_t n = area.size();
  ASSERT_EQ(form_factor.size(), n * n);
  std::size_t seeing = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double row_sum = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const double there = area[i] * form_factor[i * n + j];
      ASSERT_NEAR(there, area[j] * form_factor[j * n + i], 1e-15) << i << ' ' << j;
      row_sum += form_factor[i * n + j];
    }
    ASSERT_LT(row_sum, 1 + 1e-5);
    if (row_sum > 0.1) ++seeing;
  }
  EXPECT_GT(seeing, n / 2);  // a block stands on some of the others
}

TEST_F(CommandLine, ExportsTheTransferOfTheFormFactors) {
  const std::string file =
      precompute("box.safetensors", {"--operator", "dense", "--store-form-factors"});
  summary_of({"export", file, "--what", "form-factors", "-o", path("f.npz")});
  summary_of({"export", file, "--what", "transfer", "-o", path("y.npz")});
  const auto f = test::npz_values<double>(test::unzip(path("f.npz")), "form_factor", "<f8");
  const auto arrays = test::unzip(path("y.npz"));
  const auto y = test::npz_values<float>(arrays, "transfer", "<f4");
  const auto reflectance = test::npz_values<float>(arrays, "reflectance", "<f4");
  const std::size_t n = reflectance.size() / 3;
  ASSERT_EQ(y.size(), 3 * n * n);
  for (std::size_t c = 0; c < 3; ++c) {
    double apart_squared = 0, norm_squared = 0;
    std::vector<double> product(n);
    for (std::size_t i = 0; i < n; ++i) {
      const float* row = y.data() + (c * n + i) * n;
      for (std::size_t j = 0; j < n; ++j) product[j] = row[j];
      for (std::size_t k = 0; k < n; ++k) {
        const double weight = static_cast<double>(row[k]) * reflectance[3 * k + c];
        for (std::size_t j = 0; j < n; ++j) product[j] -= weight * f[k * n + j];
      }
      for (std::size_t j = 0; j < n; ++j) {
        const double apart = product[j] - f[i * n + j];
        apart_squared += apart * apart;
        norm_squared += f[i * n + j] * f[i * n + j];
      }
    }
    // Single precision, and the Cholesky factorisation of a well-conditioned matrix.
    EXPECT_LT(std::sqrt(apart_squared / norm_squared), 1e-6) << "channel " << c;
  }
}

TEST_F(CommandLine, ExportsPatchesAndMesh) {
  const std::string file = precompute("box.safetensors");
  const json patches = summary_of({"export", file, "--what", "patches", "-o", path("p.npz")});
  for (const char* name : {"area", "centroid", "normal", "reflectance", "emitted_exitance"}) {
    EXPECT_TRUE(patches["arrays"].contains(name)) << name;
  }
  const auto area = test::npz_values<float>(test::unzip(path("p.npz")), "area", "<f4");
  EXPECT_EQ(patches["arrays"]["area"][0], area.size());
  EXPECT_NEAR(static_cast<double>(area.size()), kPatchCount, 0.2 * kPatchCount);
  const json mesh = summary_of({"export", file, "--what", "mesh", "-o", path("m.npz")});
  EXPECT_EQ(mesh["arrays"]["triangle"][1], 3);
}

TEST_F(CommandLine, GivesTheSameBytesForAnyNumberOfThreads) {
  const std::string one = test::read_bytes(precompute("1.safetensors", {"--threads", "1"}));
  EXPECT_EQ(one, test::read_bytes(precompute("2.safetensors", {"--threads", "2"})));
  EXPECT_EQ(one, test::read_bytes(precompute("5.safetensors", {"--threads", "5"})));
}

TEST_F(CommandLine, TheSeedDecides) {
  const std::string seven = test::read_bytes(precompute("7.safetensors", {"--seed", "7"}));
  EXPECT_EQ(seven, test::read_bytes(precompute("again.safetensors", {"--seed", "7"})));
  EXPECT_NE(seven, test::read_bytes(precompute("8.safetensors", {"--seed", "8"})));
}

TEST_F(CommandLine, StoresHalfPrecisionInHalfTheBytes) {
  const auto info = [&](const std::string& precision) {
    return summary_of({"info", precompute(precision + ".safetensors",
                                          {"--operator", "dense", "--precision", precision})});
  };
  const json full = info("f32"), half = info("f16");
  EXPECT_EQ(full["operator_bytes"], 2 * half["operator_bytes"].get<std::uint64_t>());
  EXPECT_LT(half["error_max"].get<double>(), 1e-3);
}

TEST_F(CommandLine, RefusesWhatNeedsTooMuchMemoryBeforeItBegins) {
  for (const Words& from : {Words{"--operator", "dense"}, Words{"--operator", "hierarchical"},
                            Words{"--operator", "low-rank"}, Words{"--form-factors", "links"}}) {
    SCOPED_TRACE(from[1]);
    expect_refused({"precompute", kScene, "--patches", "300", from[0], from[1], "--memory-limit",
                    "0.0001", "-o", path("x.safetensors")},
                   "the limit is 0.0001 GiB");
  }
}

TEST_F(CommandLine, StopsCleanlyWhenInterrupted) {
  test::Subprocess program(
      {REBOUNCE_PROGRAM, "precompute", kScene, "--patches", "4000", "-o", path("x.safetensors")},
      printed_ / "out", printed_ / "err");
  ASSERT_TRUE(program.has_said(" patches: about "));
  program.send(SIGINT);
  const Outcome outcome = program.finish();
  EXPECT_GT(outcome.exit_code, 0) << "should end by itself, with an error";
  EXPECT_NE(outcome.err.find("rebounce: "), std::string::npos) << outcome.err;
  EXPECT_EQ(folder_.names(), Names{});
}

TEST_F(CommandLine, RefusesAMalformedLightFileWithTheField) {
  const std::string file = precompute("box.safetensors");
  const std::pair<std::string, std::string> cases[] = {
      {"", "JSON"},
      {"{", "JSON"},
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
      {R"({"lights": [{"position": [1, 2, 1e300]}]})", "\"position\""},
      {R"({"lights": [{"direction": [0, 0, 0]}]})", "\"direction\""},
      {R"({"lights": [{"color": [1, -1, 1]}]})", "\"color\""},
      {R"({"lights": [{"color": 1}]})", "\"color\""},
      {R"({"lights": [{"intensity": -5}]})", "\"intensity\""},
      {R"({"lights": [{"intensity": "bright"}]})", "\"intensity\""},
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

TEST_F(CommandLine, TakesEveryKindOfLight) {
  const std::string file = precompute("box.safetensors");
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

TEST_F(CommandLine, PutsProbesIntoTheFile) {
  const Words words = {"precompute", kScene, "--patches", "300", "-o", path("p.safetensors")};
  const auto with = [&](const std::string& probes) {
    Words more = words;
    more.insert(more.end(), {"--probes", probes});
    return more;
  };
  const double plain = summary_of(words)["file_bytes"].get<double>();
  EXPECT_GT(summary_of(with("2,2,2"))["file_bytes"].get<double>(), plain + 10000);
  EXPECT_GT(summary_of(with("0.25"))["file_bytes"].get<double>(), plain + 10000);
  for (const char* bad : {"2,2", "0,1,1", "1.5,1,1", "-1", "0.001"}) {
    const Outcome outcome = run(with(bad));
    EXPECT_NE(outcome.exit_code, 0) << bad;
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

TEST_F(CommandLine, TakesLightsFromAGlb) {
  const std::string file = precompute("box.safetensors");
  const std::string scene = write("lit.glb", glb(scene_with_light()));
  summary_of({"solve", file, "--lights", scene, "-o", path("glb.csv")});
  summary_of({"solve", file, "--lights", kLights, "-o", path("json.csv")});
  EXPECT_EQ(test::read_bytes(path("glb.csv")), test::read_bytes(path("json.csv")));

  summary_of({"precompute", scene, "--patches", "300", "-o", path("lit.safetensors")});
  summary_of({"solve", path("lit.safetensors"), "-o", path("own.csv")});
  EXPECT_EQ(test::read_bytes(path("own.csv")), test::read_bytes(path("json.csv")));
}

TEST_F(CommandLine, RefusesToRelightWithoutAnyLight) {
  json dark = json::parse(test::read_bytes(kScene));
  for (json& material : dark["materials"]) material.erase("emissiveFactor");
  summary_of({"precompute", write("dark.gltf", dark.dump()), "--patches", "300", "-o",
              path("dark.safetensors")});
  expect_refused({"solve", path("dark.safetensors"), "-o", path("x.csv")}, "--lights");
  // A picture may have a lamp of its own.
  summary_of(
      {"render", path("dark.safetensors"), "--key-light", "--size", "32x24", "-o", path("x.png")});
}

TEST_F(CommandLine, DrawsWhateverIsAskedFor) {
  const std::string file = precompute("box.safetensors", {"--store-form-factors"});
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

TEST_F(CommandLine, StoresReceiversAndSourcesAlone) {
  const std::string file = path("box.safetensors"), solution = path("x.csv");
  const json made =
      summary_of({"precompute", kScene, "--patches", "600", "--receivers", "mesh:floor,tall block",
                  "--receivers", "box:0,0,0,1,0.1,1", "--sources", "ceiling,material:red",
                  "--store-form-factors", "-o", file});
  EXPECT_EQ(made["operator"], "hierarchical");
  const json info = summary_of({"info", file});
  const auto n = info["patch_count"].get<std::size_t>();
  const auto receivers = info["receiver_count"].get<std::size_t>();
  EXPECT_GT(receivers, n / 10);
  EXPECT_LT(receivers, n * 6 / 10);
  EXPECT_GT(info["source_count"].get<std::size_t>(), n / 10);
  EXPECT_LT(info["source_count"].get<std::size_t>(), n / 2);
  EXPECT_EQ(info["settings"]["sources"], (json{"ceiling", "material:red"}));
  EXPECT_EQ(info["settings"]["receivers"].size(), 3U);
  const json& roles = info["roles"];
  EXPECT_EQ(roles["both"].get<std::size_t>() + roles["receiver_only"].get<std::size_t>(),
            receivers);
  EXPECT_EQ(roles["both"].get<std::size_t>() + roles["receiver_only"].get<std::size_t>() +
                roles["source_only"].get<std::size_t>() + roles["neither"].get<std::size_t>(),
            n);
  EXPECT_GT(roles["neither"], 0);
  EXPECT_GT(roles["part_of_pairs"], 0);
  EXPECT_LT(roles["part_of_pairs"], 0.5);
  EXPECT_GT(made["estimate"]["peak_bytes"], 0);
  EXPECT_GT(made["estimate"]["form_factor_seconds"], 0);
  EXPECT_GT(made["estimate"]["inverse_seconds"], 0);
  EXPECT_LT(info["error_mean"].get<double>(), 0.005);

  summary_of({"solve", file, "--lights", kLights, "-o", solution});
  const Table table = read_csv(solution);
  const auto lit = static_cast<std::size_t>(std::ranges::count_if(
      table.rows, [](const std::vector<double>& row) { return row.at(3) != 0; }));
  // What is under the blocks sees nothing.
  EXPECT_LE(lit, receivers);
  EXPECT_GT(lit, receivers * 3 / 4);
  summary_of({"solve", file, "--lights", kLights, "-o", solution, "--method", "gauss-seidel"});
  expect_refused({"solve", file, "-o", path("y.csv"), "--method", "refine"},
                 "receivers or sources");
  const json whole = summary_of({"info", precompute("whole.safetensors")});
  EXPECT_EQ(whole["receiver_count"], whole["patch_count"]);
  EXPECT_EQ(whole["source_count"], whole["patch_count"]);
  EXPECT_EQ(whole["roles"]["both"], whole["patch_count"]);
  EXPECT_EQ(whole["roles"]["part_of_pairs"], 1);
}

TEST_F(CommandLine, RefusesReceiversAndSourcesThatAreNotThere) {
  const auto attempt = [&](const Words& options, const std::string& part) {
    Words words = {"precompute", kScene, "-o", path("x.safetensors")};
    words.insert(words.end(), options.begin(), options.end());
    expect_refused(words, part);
  };
  attempt({"--receivers", "flor"}, R"(receivers: the scene has no mesh or material "flor"; there)");
  attempt({"--receivers", "flor"}, R"("floor")");
  attempt({"--sources", "floor,mesh:red"}, R"(sources: the scene has no mesh "red")");
  attempt({"--sources", "box:1,2,3"}, "two corners");
  attempt({"--sources", "box:9,9,9,10,10,10"}, "the named surfaces have no patches");
  attempt({"--receivers", "floor", "--operator", "dense"}, "hierarchical operators alone");
  attempt({"--receivers", "floor", "--operator", "low-rank"}, "hierarchical operators alone");
}

TEST_F(CommandLine, TheShippedScenesAreWhatTheirScriptsMake) {
  // ./dev test installs it; the scenes are shipped, so that nothing else needs it.
  if (std::system("python3 --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs python3";
  const std::string command =
      "python3 '" + kScenes + "make_cornell_box.py' '" + path("box.gltf") + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(test::read_bytes(path("box.gltf")), test::read_bytes(kScene));
  ASSERT_EQ(std::system(("python3 '" + kScenes + "make_rooms.py' '" + path(".") + "'").c_str()), 0);
  for (const std::string name :
       {"two_rooms", "three_rooms", "furnished_room", "white_room", "pavilion"}) {
    const std::string file = name + ".gltf";
    EXPECT_EQ(test::read_bytes(path(file)), test::read_bytes(kScenes + file)) << name;
  }
}

}  // namespace
}  // namespace rebounce

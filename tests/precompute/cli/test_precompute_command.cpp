// `rebounce precompute` as scripts see it: what it refuses, stores and says.

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "precompute/compression/hierarchical_settings.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/precompute/cli/solution_table.h"
#include "tests/support/command_line.h"
#include "tests/support/npz_reader.h"

namespace rebounce::test_precompute_command {
namespace {

using nlohmann::json;
using test::difference;
using test::kLights;
using test::kScene;
using test::Names;
using test::Outcome;
using test::read_csv;
using test::Table;
using test::Words;
using PrecomputeCommand = test::CommandLine;

TEST_F(PrecomputeCommand, HoldsWhatARunNeedsAndFormFactorsOnRequest) {
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

TEST_F(PrecomputeCommand, LampsOfAFileBecomeThoseOfTheScene) {
  const std::string bare = precompute("bare.safetensors"),
                    lit = precompute("lit.safetensors", {"--lights", kLights});
  EXPECT_EQ(summary_of({"info", bare})["light_count"], 0);
  const json info = summary_of({"info", lit});
  EXPECT_EQ(info["light_count"], 1);
  EXPECT_EQ(info["settings"]["lamp_weight"], SubdivisionSettings{}.lamp_weight);
  // They shine where no other light is given, and a file of lights may give others.
  const auto solve = [&](const std::string& file, const Words& lights) {
    Words words{"solve", file, "-o", path("x.csv")};
    words.insert(words.end(), lights.begin(), lights.end());
    summary_of(words);
    return test::read_bytes(path("x.csv"));
  };
  EXPECT_EQ(solve(lit, {}), solve(lit, {"--lights", kLights}));
  EXPECT_NE(solve(lit, {}), solve(bare, {"--lights", kLights})) << "patches follow the lamps";
  const auto refuse = [&](const std::string& lights, const std::string& words) {
    expect_refused({"precompute", kScene, "--lights", lights, "-o", path("x.safetensors")}, words);
  };
  refuse(path("no.json"), "no.json");
  refuse(kScene, "KHR_lights_punctual");
}

TEST_F(PrecomputeCommand, AFileKeepsThePunctualLampsOfThoseThatShapeIt) {
  const std::string lamps = write("lamps.json", R"({"lights": [
      {"type": "sphere", "position": [0, 1.9, 0], "radius": 0.05, "intensity": 20000},
      {"type": "point", "position": [0.2, 1, 0], "intensity": 10}]})");
  const std::string file = path("lit.safetensors");
  const Outcome built = run(test::quick(
      {"precompute", kScene, "--patches", "100", "--lights", lamps, "--json", "-o", file}));
  ASSERT_EQ(built.exit_code, test::kDone) << built.err;
  EXPECT_NE(built.err.find("not kept in the file: 1"), std::string::npos) << built.err;
  EXPECT_EQ(summary_of({"info", file})["light_count"], 1);
}

TEST_F(PrecomputeCommand, LinksHaveNoFormFactorsOfPairs) {
  expect_refused({"precompute", kScene, "--patches", "100", "--form-factors", "links",
                  "--store-form-factors", "-o", path("x.safetensors")},
                 "--compress-form-factors");
  const double tolerance = 0.03;
  const std::string file = precompute(
      "box.safetensors", {"--form-factors", "links", "--tolerance", std::to_string(tolerance)});
  const json info = summary_of({"info", file});
  EXPECT_EQ(info["form_factors"], "none");
  EXPECT_EQ(info["compressed_form_factor_bytes"], 0);
  EXPECT_EQ(info["settings"]["form_factor_tolerance"], tolerance / 2.5);
  EXPECT_LE(info["error_mean"].get<double>(), tolerance);
}

TEST_F(PrecomputeCommand, LinksThatAreOffCountTowardTheTolerance) {
  const double tolerance = 0.02;
  const Words words = {"precompute",
                       kScene,
                       "--patches",
                       "300",
                       "--form-factors",
                       "links",
                       "--link-epsilon",
                       "0.05",
                       "--receivers-at",
                       "patches",
                       "--tolerance",
                       std::to_string(tolerance),
                       "-o",
                       path("box.safetensors"),
                       "--quiet"};
  expect_failure(words, "links and compression together");
  const json info = summary_of({"info", path("box.safetensors")});
  EXPECT_LE(info["error_mean"].get<double>(), tolerance) << "compression alone keeps it";
  const json &whole = info["whole_error"]["whole"], &links = info["whole_error"]["links"];
  EXPECT_GT(whole["mean"].get<double>(), tolerance);
  EXPECT_GT(links["mean"].get<double>(), tolerance / 2);
  EXPECT_GT(whole["max"], whole["mean"]);
  const std::string said = run({"info", path("box.safetensors")}).out;
  for (const char* part :
       {"Error against exact form factors", "links alone", "links and compression"}) {
    EXPECT_NE(said.find(part), std::string::npos) << part << " in\n" << said;
  }
}

TEST_F(PrecomputeCommand, RecordsTheSettingsThatApply) {
  const json dense = summary_of({"info", precompute("dense", {"--operator", "dense"})});
  EXPECT_EQ(dense["operator"], "dense");
  EXPECT_EQ(dense["tolerance"], 0);
  EXPECT_FALSE(dense["settings"].contains("tolerance"));
  EXPECT_FALSE(dense["settings"].contains("rank"));
  EXPECT_LT(dense["error_max"].get<double>(), 1e-5);
}

TEST_F(PrecomputeCommand, CompressesToATolerance) {
  const Words words = {"precompute",  kScene, "--patches", "1200",
                       "--tolerance", "0.02", "-o",        path("box.safetensors")};
  const json info = summary_of(test::quick(words));
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

TEST_F(PrecomputeCommand, AdvisesWhereAPatchTakesManyBytes) {
  const auto said = [&](const Words& options) {
    Words words = {"precompute", kScene, "--patches", "300", "-o", path("box.safetensors")};
    words.insert(words.end(), options.begin(), options.end());
    return run(test::quick(words)).out;
  };
  EXPECT_EQ(said({}).find("advice: "), std::string::npos);
  const std::string many = said({"--precision", "f32", "--tolerance", "0.0005"});
  EXPECT_NE(many.find("bytes per patch are many"), std::string::npos) << many;
  EXPECT_NE(many.find("--tolerance, --precision q8"), std::string::npos) << many;
}

TEST_F(PrecomputeCommand, AMissedToleranceFails) {
  // Half precision cannot be this exact.
  expect_failure(
      test::quick({"precompute", kScene, "--patches", "300", "--operator", "hierarchical",
                   "--tolerance", "0.00001", "-o", path("box.safetensors"), "--quiet"}),
      "misses its tolerance");
  EXPECT_GT(summary_of({"info", path("box.safetensors")})["error_mean"].get<double>(), 1e-5);
}

TEST_F(PrecomputeCommand, FailsIfALampIsAboveThreeTimesTheTolerance) {
  // The largest of the check is 2.5 tolerances here, so that the file is taken. Should rounding of
  // another machine make it more than three, it must be refused.
  const Outcome outcome =
      run({"precompute", kScene, "--patches", "300", "--form-factors", "links", "--receivers-at",
           "patches", "-o", path("box.safetensors"), "--quiet"});
  const double largest = summary_of({"info", path("box.safetensors")})["error_max"].get<double>();
  const bool kept = largest <= 3 * kDefaultTolerance;
  EXPECT_EQ(outcome.exit_code, kept ? 0 : 1);
  EXPECT_EQ(outcome.err.find("errs too much under single lamps") == std::string::npos, kept)
      << outcome.err;
}

TEST_F(PrecomputeCommand, FormFactorsThatMissTheirToleranceFail) {
  expect_failure(test::quick({"precompute", kScene, "--patches", "300", "--compress-form-factors",
                              "0.00001", "-o", path("box.safetensors"), "--quiet"}),
                 "miss their tolerance");
  const json report = summary_of({"info", path("box.safetensors")})["report"];
  EXPECT_GT(report["form_factor_error_mean"].get<double>(), 1e-5);
}

TEST_F(PrecomputeCommand, IntegersAreRefusedBeforeAnythingIsComputed) {
  for (const std::string kind : {"dense", "low-rank"}) {
    // The estimate, which comes before the form factors, would be a line of its own.
    expect_failure({"precompute", kScene, "--patches", "300", "--operator", kind, "--precision",
                    "q8", "-o", path("box.safetensors")},
                   "hierarchical");
  }
}

TEST_F(PrecomputeCommand, RelightsByOperatorsOfLowRank) {
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

TEST_F(PrecomputeCommand, MeetsThePatchSize) {
  const json made = summary_of(test::quick(
      {"precompute", kScene, "--patch-size", "0.1", "-o", path("box.safetensors"), "--quiet"}));
  // The surfaces measure 2.1 m2; the largest patch of that length is a square, the smallest a right
  // triangle half as long.
  EXPECT_GT(made["patch_count"].get<int>(), 2.1 / 0.005);
  EXPECT_LT(made["patch_count"].get<int>(), 2.1 / 0.000625);
}

TEST_F(PrecomputeCommand, WorksWithoutPairs) {
  const std::string file = path("box.safetensors");
  const json built =
      summary_of({"precompute", kScene, "--patches", "400", "--form-factors", "links",
                  "--tolerance", "0.02", "--store-links", "--compress-form-factors", "0.004",
                  "--receivers-at", "patches", "-o", file});
  EXPECT_EQ(built["form_factors"], "compressed");
  EXPECT_EQ(built["form_factor_count"], 0);
  EXPECT_GT(built["link_count"], 0);
  EXPECT_GT(built["report"]["solves"], 0);
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

TEST_F(PrecomputeCommand, LinksMakeHierarchicalOperatorsOnly) {
  for (const std::string kind : {"dense", "low-rank"}) {
    expect_refused({"precompute", kScene, "--patches", "100", "--form-factors", "links",
                    "--operator", kind, "-o", path("x.safetensors")},
                   "only a hierarchical operator");
  }
}

TEST_F(PrecomputeCommand, PairsHaveNoErrorOfALink) {
  expect_refused({"precompute", kScene, "--patches", "100", "--link-epsilon", "0.001", "-o",
                  path("x.safetensors")},
                 "from links");
}

TEST_F(PrecomputeCommand, QualitySetsTheRaysOfFormFactors) {
  const json low = summary_of({"info", precompute("low.safetensors", {"--quality", "low"})});
  const json usual =
      summary_of({"info", precompute("usual.safetensors", {"--quality", "default"})});
  EXPECT_EQ(low["settings"]["hemisphere_rays"], 1024);
  EXPECT_EQ(low["settings"]["full_rays"], 16);
  EXPECT_EQ(usual["settings"]["hemisphere_rays"], 4096);
}

TEST_F(PrecomputeCommand, GivesTheSameBytesForAnyNumberOfThreads) {
  const auto as_by_default = [](const char* threads) {
    return Words{"--threads", threads, "--quality", "default", "--receivers-at", "where-needed"};
  };
  const std::string one = test::read_bytes(precompute("1.safetensors", as_by_default("1")));
  EXPECT_EQ(one, test::read_bytes(precompute("2.safetensors", as_by_default("2"))));
  EXPECT_EQ(one, test::read_bytes(precompute("5.safetensors", as_by_default("5"))));
}

TEST_F(PrecomputeCommand, TheSeedDecides) {
  const std::string seven = test::read_bytes(precompute("7.safetensors", {"--seed", "7"}));
  EXPECT_EQ(seven, test::read_bytes(precompute("again.safetensors", {"--seed", "7"})));
  EXPECT_NE(seven, test::read_bytes(precompute("8.safetensors", {"--seed", "8"})));
}

TEST_F(PrecomputeCommand, StoresHalfPrecisionInHalfTheBytes) {
  const auto info = [&](const std::string& precision) {
    return summary_of({"info", precompute(precision + ".safetensors",
                                          {"--operator", "dense", "--precision", precision})});
  };
  const json full = info("f32"), half = info("f16");
  EXPECT_EQ(full["operator_bytes"], 2 * half["operator_bytes"].get<std::uint64_t>());
  EXPECT_LT(half["error_max"].get<double>(), 1e-3);
}

TEST_F(PrecomputeCommand, RefusesWhatNeedsTooMuchMemoryBeforeItBegins) {
  for (const Words& from : {Words{"--operator", "dense"}, Words{"--operator", "hierarchical"},
                            Words{"--operator", "low-rank"}, Words{"--form-factors", "links"}}) {
    SCOPED_TRACE(from[1]);
    expect_refused({"precompute", kScene, "--patches", "300", from[0], from[1], "--memory-limit",
                    "0.0001", "-o", path("x.safetensors")},
                   "the limit is 0.0001 GiB");
  }
  // Their patches alone would take hours, and the memory of the machine.
  for (const Words& patches : {Words{"--patch-size", "1e-6"}, Words{"--patches", "1000000"}}) {
    SCOPED_TRACE(patches[0]);
    expect_refused({"precompute", kScene, patches[0], patches[1], "--memory-limit", "2", "-o",
                    path("x.safetensors")},
                   "ask for fewer or larger patches");
  }
}

TEST_F(PrecomputeCommand, StopsCleanlyWhenInterrupted) {
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

TEST_F(PrecomputeCommand, PutsProbesIntoTheFile) {
  const Words words =
      test::quick({"precompute", kScene, "--patches", "300", "-o", path("p.safetensors")});
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

TEST_F(PrecomputeCommand, StoresReceiversAndSourcesAlone) {
  const std::string file = path("box.safetensors"), solution = path("x.csv");
  const json made = summary_of(
      test::quick({"precompute", kScene, "--patches", "600", "--receivers", "mesh:floor,tall block",
                   "--receivers", "box:0,0,0,1,0.1,1", "--sources", "ceiling,material:red",
                   "--store-form-factors", "-o", file}));
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

TEST_F(PrecomputeCommand, RefusesReceiversAndSourcesThatAreNotThere) {
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

TEST_F(PrecomputeCommand, RefusesWhatTheOperatorDoesNotLookAt) {
  const auto attempt = [&](const Words& options, const std::string& part) {
    Words words = {"precompute", kScene, "-o", path("x.safetensors")};
    words.insert(words.end(), options.begin(), options.end());
    expect_refused(words, part);
  };
  attempt({"--rank", "64"}, "--rank has no part in a hierarchical operator");
  attempt({"--operator", "dense", "--tolerance", "0.01"}, "--tolerance has no part in a dense");
  attempt({"--operator", "low-rank", "--tolerance", "0.01"}, "give --operator hierarchical");
}

TEST_F(PrecomputeCommand, SaysWhatOfALightFileHasNoPartInABuild) {
  const std::string lights = path("lights.json");
  std::ofstream(lights) << R"({"sky": {"luminance": 100}, "lights": []})";
  const auto outcome = run(test::quick(
      {"precompute", kScene, "--patches", "60", "--lights", lights, "-o", path("x.safetensors")}));
  EXPECT_EQ(outcome.exit_code, test::kDone) << outcome.err;
  EXPECT_NE(outcome.err.find("sky and emitters are no lamps"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("there is no lamp"), std::string::npos) << outcome.err;
  const json warnings = summary_of({"info", path("x.safetensors")})["report"]["warnings"];
  EXPECT_EQ(warnings.size(), 2U) << warnings;
}

TEST_F(PrecomputeCommand, WritesForPagesPackedFilesAndFormFactorsApart) {
  const std::string whole = precompute("whole.safetensors", {"--compress-form-factors", "0.01"});
  const std::string page =
      precompute("page.safetensors", {"--compress-form-factors", "0.01", "--for", "web"});
  const std::string apart = test::read_bytes(folder_ / "page.form_factors.safetensors");
  const std::string packed = test::read_bytes(page);
  for (const std::string& file : {packed, apart}) {
    EXPECT_EQ(file.substr(0, 2), "\x1f\x8b");
  }
  EXPECT_LT(packed.size() + apart.size(), test::read_bytes(whole).size() * 3 / 4);
  precompute("page.safetensors", {"--for", "web"});  // whose second file would be of another build
  EXPECT_FALSE(std::filesystem::exists(folder_ / "page.form_factors.safetensors"));
  for (const Words& option : {Words{"--lightmap", "64"}, Words{"--store-form-factors"}}) {
    Words words = {"precompute", kScene, "-o", path("x.safetensors"), "--for", "web"};
    words.insert(words.end(), option.begin(), option.end());
    expect_refused(words, "--for web leaves out what " + option.front() + " makes");
  }
}

}  // namespace
}  // namespace rebounce::test_precompute_command

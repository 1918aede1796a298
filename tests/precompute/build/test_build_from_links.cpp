// The offline stage without pairs of patches, against the same with them.

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "precompute/build/kept_tolerances.h"
#include "precompute/build/transfer_build.h"
#include "precompute/exchange/links/links.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_solution.h"
#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scenes.h"
#include "transfer/base/area_norm.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_build_from_links {
namespace {

constexpr std::uint64_t kSeed = 20261120;
constexpr std::size_t kRoomPatches = 300;
constexpr double kTolerance = 0.01;

// The same under the lamp for which links are worst.
constexpr double kErrorInNooks = 0.15;

// What rows of closed rooms may be off: scaling stops after a number of steps.
constexpr double kClosure = 1e-3;

// What is said counts what the process holds, and the address sanitizer keeps what was freed.
#ifdef __SANITIZE_ADDRESS__
constexpr bool kGivesMemoryBack = false;
#else
constexpr bool kGivesMemoryBack = true;
#endif

const std::string kScenes = REBOUNCE_SOURCE_DIR "/tests/scenes/";
const std::string kRoom = kScenes + "furnished_room.gltf";
const std::string kBareRoom = kScenes + "white_room.gltf";

struct Built {
  TransferData data;
  BuildReport report;
};

BuildSettings settings_from_links() {
  BuildSettings settings;
  settings.subdivision.patch_count = kRoomPatches;
  settings.exchange_source = ExchangeSource::kLinks;
  settings.tolerance = kTolerance;
  settings.form_factor_tolerance = kTolerance / 5;
  settings.store_links = true;
  settings.receiver_rows.at_vertices = false;
  return settings;
}

Built build(const std::string& scene, const BuildSettings& settings) {
  Built built;
  built.data = build_transfer_data(scene, settings, built.report);
  return built;
}

/// Where it does not matter how good the links are, or how many.
BuildSettings quick_settings() {
  BuildSettings settings = settings_from_links();
  settings.subdivision.patch_count = 250;
  settings.form_factors = with_quality(FormFactorQuality::kLow);
  return settings;
}

/// What a build cannot do without, by the estimate before links are known.
std::uint64_t least_memory(BuildSettings settings) {
  settings.memory_limit_bytes = 1;
  BuildReport report;
  EXPECT_THROW(build_transfer_data(kBareRoom, settings, report), Error);
  return report.estimate.peak_bytes;
}

/// Form factors alone.
Built exchange_of(const std::string& scene, ExchangeSource kind, std::size_t patch_count) {
  BuildSettings settings;
  settings.subdivision.patch_count = patch_count;
  settings.exchange_source = kind;
  settings.store_form_factors = kind == ExchangeSource::kPairs;
  settings.operator_kind = OperatorKind::kNoOperator;
  settings.receiver_rows.at_vertices = false;
  Built built;
  built.data = build_transfer_data(kScenes + scene, settings, built.report);
  return built;
}

/// The furnished room from links, made once.
const Built& room() {
  static const Built built = build(kRoom, settings_from_links());
  return built;
}

std::vector<std::vector<Float3>> point_lights(const TransferData& data) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  return random_initial_exitances(data, tracer, LightKind::kPoint, 16, kSeed);
}

std::vector<Float3> relit(const TransferData& data, const std::vector<Float3>& light) {
  std::vector<Float3> result(light.size());
  std::vector<float> workspace(data.transfer->workspace_size());
  data.transfer->apply(light, result, workspace);
  return result;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Of the room's operator under lights, whose truth is given.
std::vector<double> errors_against(const std::vector<std::vector<Float3>>& lights,
                                   const std::vector<std::vector<Float3>>& truths) {
  const TransferData& data = room().data;
  std::vector<double> errors;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    errors.push_back(relative_difference(relit(data, lights[k]), truths[k], data.patches.area));
  }
  return errors;
}

// One test: every one is a process, and builds the room for itself.
TEST(BuildFromLinks, KeepsNoPairsAndIsTheirLightWithTheErrorOnRecord) {
  const TransferData& data = room().data;
  const BuildReport& report = room().report;
  EXPECT_TRUE(data.exchange.empty());
  ASSERT_NE(data.compressed_form_factors, nullptr);
  EXPECT_FALSE(data.links.empty());
  EXPECT_EQ(report.form_factor_count, 0U);
  EXPECT_EQ(report.link_count, data.links.pair.size());
  EXPECT_GT(report.solve_count, 0U);

  // The error on record is that against the links.
  EXPECT_GT(data.record.error_mean, 0);
  EXPECT_LE(data.record.error_mean, kTolerance);
  ASSERT_TRUE(report.form_factor_error);
  EXPECT_LE(report.form_factor_error->mean, report.form_factor_tolerance);
  EXPECT_EQ(report.form_factor_error->light_count + report.form_factor_error->dark_count, 16);
  const auto lights = point_lights(data);
  const auto of_links = errors_against(
      lights, ReferenceSolver(data.links, data.patches).indirect_irradiances(lights));
  EXPECT_LT(mean(of_links), 1.5 * data.record.error_mean);
  EXPECT_LT(std::ranges::max(of_links), data.record.error_bound);

  // Those that are stored are fewer than those that it was made from.
  const Built found = exchange_of("furnished_room.gltf", ExchangeSource::kLinks, kRoomPatches);
  EXPECT_LT(data.links.pair.size(), found.data.links.pair.size() * 2 / 3);

  const Built pairs = exchange_of("furnished_room.gltf", ExchangeSource::kPairs, kRoomPatches);
  ASSERT_EQ(pairs.data.patches.area, data.patches.area);
  const auto of_pairs =
      errors_against(lights, ReferenceSolver(pairs.data).indirect_irradiances(lights));
  RecordProperty("error", std::to_string(mean(of_pairs)));
  EXPECT_LT(mean(of_pairs), kTolerance);
  EXPECT_LT(std::ranges::max(of_pairs), kErrorInNooks);
  // What is stated is that, and the build keeps its tolerance.
  ASSERT_TRUE(report.whole_error);
  const SampledError& whole = report.whole_error->whole;
  EXPECT_GT(whole.mean, data.record.error_mean / 2);
  EXPECT_NEAR(mean(of_pairs), whole.mean, kTolerance / 2);
  EXPECT_NO_THROW(check_tolerances(data.record, report, true));
}

TEST(BuildFromLinks, WhatRowsLeaveOfOneEscapes) {
  for (const std::string scene : {"furnished_room.gltf", "pavilion.gltf"}) {
    const Built of_pairs = exchange_of(scene, ExchangeSource::kPairs, 200),
                of_links = exchange_of(scene, ExchangeSource::kLinks, 200);
    const TransferData &pairs = of_pairs.data, &data = of_links.data;
    const ClosureReport& closure = of_links.report.closure;
    const PatchTable& patches = data.patches;
    const LinkedFormFactors links(data.links, patches.area, patches.centroid);
    GatheredLights<std::array<double, 3>> ones;
    ones.in.assign(patches.size(), {1, 1, 1});
    links.gather(ones);
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const double all = ones.out[i][0] + patches.sky_visibility[i] + patches.absorbed[i];
      EXPECT_NEAR(all, 1, kClosure) << scene << " " << i;
      EXPECT_NEAR(patches.sky_visibility[i], pairs.patches.sky_visibility[i], 0.02) << i;
    }
    EXPECT_EQ(data.sky_cells.empty(), pairs.sky_cells.empty());
    EXPECT_LT(closure.row_sum_error_after, kClosure);
    EXPECT_GT(closure.row_sum_error_before, closure.row_sum_error_after);
    EXPECT_GT(closure.relative_change, 0);
    EXPECT_LT(closure.relative_change, 0.1);
  }
}

TEST(BuildFromLinks, TheFileIsTheSameForAnyThreadsAnyMemoryAndWithACheckpoint) {
  const test::TemporaryFolder folder;
  BuildSettings settings = quick_settings();
  save_transfer_file(folder / "usual", build(kBareRoom, settings).data);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(threads + 3);
  // Not enough for all threads.
  settings.memory_limit_bytes = least_memory(settings) * 3 / 2;
  settings.checkpoint = folder / "parts";
  const int asked = omp_get_max_threads();
  const Built limited = build(kBareRoom, settings);
  EXPECT_EQ(omp_get_max_threads(), asked);
  omp_set_num_threads(threads);
  EXPECT_LE(limited.report.estimate_after_links->peak_bytes, settings.memory_limit_bytes);
  save_transfer_file(folder / "other", limited.data);
  EXPECT_EQ(test::read_bytes(folder / "usual"), test::read_bytes(folder / "other"));
  EXPECT_TRUE(std::filesystem::exists(folder / "parts" / "cell_0000"));
  EXPECT_TRUE(std::filesystem::exists(folder / "parts" / "round_0_part_0000"));
}

TEST(BuildFromLinks, SaysAgainWhatIsLeftWhenLinksAreKnown) {
  std::vector<CostEstimate> estimates;
  BuildReport report;
  EXPECT_THROW(build_transfer_data(
                   kBareRoom, quick_settings(), report,
                   [](std::string_view phase, double) { return phase != "fitting lights"; },
                   [&](const CostEstimate& estimate) { estimates.push_back(estimate); }),
               Cancelled);
  ASSERT_EQ(estimates.size(), 2U);
  EXPECT_EQ(estimates[0].link_count, 0U);
  EXPECT_EQ(estimates[1].link_count, report.link_count);
  EXPECT_EQ(estimates[1].patch_count, report.patch_count);
  if (kGivesMemoryBack) {
    const auto first = static_cast<double>(estimates[0].peak_bytes),
               second = static_cast<double>(estimates[1].peak_bytes);
    EXPECT_NEAR(first / second, 1, 0.25) << "their number is forecast from a sample";
  }
  EXPECT_EQ(report.estimate_after_links->peak_bytes, estimates[1].peak_bytes);
}

TEST(BuildFromLinks, RefusesWhatIsOverTheLimitWithTheNumbers) {
  BuildSettings settings = quick_settings();
  settings.memory_limit_bytes = 1 << 20;
  BuildReport report;
  const std::string refusal =
      test::error_of([&] { build_transfer_data(kBareRoom, settings, report); });
  EXPECT_NE(refusal.find(" patches (from "), std::string::npos) << refusal;
  const std::string need = " need about ";
  ASSERT_NE(refusal.find(need), std::string::npos) << refusal;
  const double gib = std::stod(refusal.substr(refusal.find(need) + need.size()));
  const auto said = static_cast<double>(report.estimate.peak_bytes);
  EXPECT_NEAR(gib * (1 << 30), said, 0.01 * said);
  EXPECT_NE(refusal.find("the limit is 0.000977 GiB"), std::string::npos) << refusal;
}

TEST(BuildFromLinks, LinksAreTakenWherePairsAreOverTheLimit) {
  if (!kGivesMemoryBack) GTEST_SKIP() << "the address sanitizer keeps memory that was freed";
  const auto peak_bytes = [&](ExchangeSource kind, std::uint64_t limit) {
    BuildSettings settings;
    settings.subdivision.patch_count = 9000;  // of fewer, links do not take much less
    settings.exchange_source = kind;
    settings.memory_limit_bytes = limit;
    std::uint64_t bytes = 0;
    BuildReport report;
    EXPECT_THROW(build_transfer_data(
                     kScenes + "white_room.gltf", settings, report,
                     [](std::string_view phase, double) { return phase != "form factors"; },
                     [&](const CostEstimate& estimate) { bytes = estimate.peak_bytes; }),
                 Error);
    return bytes;
  };
  const std::uint64_t pairs = peak_bytes(ExchangeSource::kPairs, 0),
                      links = peak_bytes(ExchangeSource::kLinks, pairs - 1);
  ASSERT_GT(pairs, links + links / 4);
  // What the process holds already counts. It depends on what ran before, by far less than this.
  const std::uint64_t held_more = (pairs - links) / 4;
  EXPECT_NEAR(peak_bytes(ExchangeSource::kAutomatic, 0), pairs, held_more);
  EXPECT_NEAR(peak_bytes(ExchangeSource::kAutomatic, pairs + held_more), pairs, held_more);
  EXPECT_NEAR(peak_bytes(ExchangeSource::kAutomatic, pairs - held_more), links, held_more);
}

}  // namespace
}  // namespace rebounce::test_build_from_links

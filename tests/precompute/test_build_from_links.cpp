// The offline stage without pairs of patches, against the same with them.

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "expect_error.h"
#include "rebounce/precompute/build.h"
#include "rebounce/precompute/links.h"
#include "rebounce/precompute/random_lights.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/transfer_file.h"
#include "temporary_folder.h"
#include "test_scenes.h"

namespace rebounce {
namespace {

constexpr std::uint64_t kSeed = 20261120;
constexpr double kTolerance = 0.01;

// Of F B, that links of kLinkEpsilon have (notes/links.md: 0.2 to 0.25 %), times the bounces that
// carry it on.
constexpr double kErrorOfLinks = 0.01;

// What rows of closed rooms may be off: scaling stops after a number of steps.
constexpr double kClosure = 1e-3;

const std::string kScenes = REBOUNCE_SOURCE_DIR "/tests/scenes/";

struct Built {
  TransferData data;
  BuildReport report;
};

Built build_from_links(std::uint64_t memory_limit_bytes = 0,
                       const std::filesystem::path& checkpoint = {}) {
  BuildSettings settings;
  settings.subdivision.patch_count = 500;
  settings.form_factor_kind = FormFactorKind::kLinks;
  settings.tolerance = kTolerance;
  settings.store_links = true;
  settings.memory_limit_bytes = memory_limit_bytes;
  settings.checkpoint = checkpoint;
  Built built;
  built.data = build_transfer_data(kScenes + "furnished_room.gltf", settings, built.report);
  return built;
}

/// Form factors alone.
Built exchange_of(const std::string& scene, FormFactorKind kind, std::size_t patch_count) {
  BuildSettings settings;
  settings.subdivision.patch_count = patch_count;
  settings.form_factor_kind = kind;
  settings.operator_kind = OperatorKind::kNoOperator;
  Built built;
  built.data = build_transfer_data(kScenes + scene, settings, built.report);
  return built;
}

/// The furnished room from links, made once.
const Built& room() {
  static const Built built = build_from_links();
  return built;
}

std::vector<std::vector<Float3>> point_lights(const TransferData& data) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  return random_initial_exitances(data, tracer, LightKind::kPoint, 16, kSeed);
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(BuildFromLinks, KeepsNoPairs) {
  const TransferData& data = room().data;
  EXPECT_TRUE(data.exchange.empty());
  ASSERT_NE(data.compressed_form_factors, nullptr);
  EXPECT_FALSE(data.links.empty());
  EXPECT_EQ(room().report.form_factor_count, 0U);
  EXPECT_EQ(room().report.link_count, data.links.pair.size());
}

TEST(BuildFromLinks, TheErrorOnRecordIsThatAgainstTheLinks) {
  const TransferData& data = room().data;
  EXPECT_GT(data.record.error_mean, 0);
  EXPECT_LE(data.record.error_mean, kTolerance);
  const auto lights = point_lights(data);
  const auto truths = ReferenceSolver(data.links, data.patches).indirect_irradiances(lights);
  std::vector<double> errors;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    errors.push_back(
        relative_difference(product(*data.transfer, lights[k]), truths[k], data.patches.area));
  }
  EXPECT_LT(mean(errors), 1.5 * data.record.error_mean);
  EXPECT_LT(std::ranges::max(errors), data.record.error_bound);
}

TEST(BuildFromLinks, IsTheLightOfPairs) {
  const Built pairs = exchange_of("furnished_room.gltf", FormFactorKind::kPairs, 500);
  const TransferData& data = room().data;
  ASSERT_EQ(pairs.data.patches.area, data.patches.area);
  const auto lights = point_lights(data);
  const auto truths = ReferenceSolver(pairs.data).indirect_irradiances(lights);
  std::vector<double> errors;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    errors.push_back(
        relative_difference(product(*data.transfer, lights[k]), truths[k], data.patches.area));
  }
  RecordProperty("error", std::to_string(mean(errors)));
  EXPECT_LT(mean(errors), data.record.error_mean + kErrorOfLinks);
}

TEST(BuildFromLinks, WhatRowsLeaveOfOneEscapes) {
  for (const std::string scene : {"furnished_room.gltf", "pavilion.gltf"}) {
    const Built of_pairs = exchange_of(scene, FormFactorKind::kPairs, 200),
                of_links = exchange_of(scene, FormFactorKind::kLinks, 200);
    const TransferData &pairs = of_pairs.data, &data = of_links.data;
    const ClosureReport& closure = of_links.report.closure;
    const PatchTable& patches = data.patches;
    const LinkedFormFactors links(data.links, patches.area, patches.centroid);
    const std::vector<std::array<double, 3>> ones(patches.size(), {1, 1, 1});
    std::vector<std::array<double, 3>> sum(patches.size());
    links.gather(std::span(ones), std::span(sum));
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const double all = sum[i][0] + patches.sky_visibility[i] + patches.absorbed[i];
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

TEST(BuildFromLinks, TheFileIsTheSameForAnyNumberOfThreadsAndWithACheckpoint) {
  const test::TemporaryFolder folder;
  const int threads = omp_get_max_threads();
  save_transfer_file(folder / "usual", room().data);
  omp_set_num_threads(threads + 1);
  save_transfer_file(folder / "other", build_from_links(0, folder / "panels").data);
  omp_set_num_threads(threads);
  EXPECT_EQ(test::read_bytes(folder / "usual"), test::read_bytes(folder / "other"));
  EXPECT_FALSE(std::filesystem::is_empty(folder / "panels"));
}

TEST(BuildFromLinks, RefusesWhatIsOverTheLimitWithTheNumbers) {
  const std::string refusal = test::error_of([] { build_from_links(1 << 20); });
  EXPECT_NE(refusal.find("500 patches (from "), std::string::npos) << refusal;
  EXPECT_NE(refusal.find(" need about 0.0"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("the limit is 0.000977 GiB"), std::string::npos) << refusal;
}

TEST(BuildFromLinks, LinksAreTakenWherePairsAreOverTheLimit) {
  const auto peak_bytes = [&](FormFactorKind kind, std::uint64_t limit) {
    BuildSettings settings;
    settings.subdivision.patch_count = 300;
    settings.form_factor_kind = kind;
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
  const std::uint64_t pairs = peak_bytes(FormFactorKind::kPairs, 0),
                      links = peak_bytes(FormFactorKind::kLinks, 0);
  ASSERT_NE(pairs, links);
  EXPECT_EQ(peak_bytes(FormFactorKind::kAutomatic, 0), pairs);
  EXPECT_EQ(peak_bytes(FormFactorKind::kAutomatic, pairs), pairs);
  EXPECT_EQ(peak_bytes(FormFactorKind::kAutomatic, pairs - 1), links);
}

}  // namespace
}  // namespace rebounce

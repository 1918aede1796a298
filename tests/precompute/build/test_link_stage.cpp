// Links are judged by rays, and made finer where they are off by too much.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "precompute/build/build_decisions.h"
#include "precompute/build/exchange_stage.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_solution.h"
#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scenes.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_link_stage {
namespace {

constexpr std::size_t kPatchCount = 300;
constexpr std::uint64_t kSeed = 20261125;
constexpr int kLights = 12;

// Links that are several times coarser than those of builds are off by some percent.
constexpr double kCoarseLinks = 1e-2;

Scene room() {
  return test::room_with_block({0.7F, 0.5F, 0.3F});
}

BuildSettings from_links(double epsilon) {
  BuildSettings settings;
  settings.exchange_source = ExchangeSource::kLinks;
  settings.form_factors.link_epsilon = epsilon;
  return settings;
}

/// The links that the stage finds for a room, and what it says of them.
struct Found {
  explicit Found(const BuildSettings& settings, bool judged = true)
      : model(make_patch_model(room(), {.patch_count = kPatchCount})),
        tracer(test::make_tracer(model)),
        decided(decide(settings, model)),
        build(find_links(model, tracer, {}, judged, decided, data, report, clock)) {}

  std::ptrdiff_t phases(const std::string& name) const {
    return std::ranges::count(report.seconds, name, [](const auto& phase) { return phase.first; });
  }

  BuildReport report;
  BuildProgress progress;
  PhaseClock clock{report, progress};
  TransferData data;
  PatchModel model;
  RayTracer tracer;
  BuildSettings decided;
  LinkBuild build;
};

/// What the light of links is off by, against very fine ones.
double error(const Found& found) {
  static const Found truth(from_links(1e-6), false);
  TransferData data;
  data.patches = truth.model.patches;
  data.patches.sky_visibility = truth.build.sky_visibility;
  data.patches.absorbed = truth.build.absorbed;
  data.mesh = truth.model.mesh;
  data.materials = room().materials;
  const auto lights =
      random_initial_exitances(data, truth.tracer, LightKind::kPoint, kLights, kSeed);
  const auto exact =
      ReferenceSolver(truth.build.form_factors, data.patches).indirect_irradiances(lights);
  const auto light =
      ReferenceSolver(found.build.form_factors, data.patches).indirect_irradiances(lights);
  double sum = 0;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    sum += relative_difference(light[k], exact[k], data.patches.area);
  }
  return sum / kLights;
}

TEST(LinkStage, MakesLinksFinerWhileTheyAreOffByTooMuch) {
  const Found once(from_links(kCoarseLinks), false), found(from_links(kCoarseLinks));
  EXPECT_EQ(once.phases("check of links"), 0);
  EXPECT_GE(found.phases("finer links"), 1);
  EXPECT_LE(found.phases("finer links"), 2);
  EXPECT_LT(found.decided.form_factors.link_epsilon, 0.7 * kCoarseLinks + 1e-12);
  EXPECT_GT(found.report.link_count, once.report.link_count);
  EXPECT_EQ(found.report.link_count, found.build.form_factors->link_count());
  EXPECT_GT(found.report.ray_count, once.report.ray_count) << "the rays of all rounds count";
  RecordProperty("error_once", std::to_string(error(once)));
  RecordProperty("error", std::to_string(error(found)));
  EXPECT_LT(error(found), 0.8 * error(once));
}

TEST(LinkStage, LeavesLinksThatAreFineEnough) {
  BuildSettings settings = from_links(1e-4);
  settings.tolerance = 0.05;
  const Found found(settings);
  EXPECT_EQ(found.phases("check of links"), 1);
  EXPECT_EQ(found.phases("finer links"), 0);
  EXPECT_EQ(found.decided.form_factors.link_epsilon, 1e-4);
}

TEST(LinkStage, LeavesLinksOfWhichFinerOnesDoNotFit) {
  BuildSettings settings = from_links(kCoarseLinks);
  settings.memory_limit_bytes = 1;
  const Found found(settings);
  EXPECT_EQ(found.phases("check of links"), 1);
  EXPECT_EQ(found.phases("finer links"), 0);
  EXPECT_GT(found.build.form_factors->link_count(), 0);
}

void expect_same(const FormFactorLinks& a, const FormFactorLinks& b) {
  EXPECT_EQ(a.patch, b.patch);
  EXPECT_EQ(a.first_child, b.first_child);
  EXPECT_EQ(a.count, b.count);
  EXPECT_EQ(a.pair, b.pair);
  EXPECT_EQ(a.exchange_area, b.exchange_area);
  EXPECT_EQ(a.gradient, b.gradient);
  EXPECT_EQ(a.scale, b.scale);
}

void expect_same(const Found& a, const Found& b) {
  expect_same(flat_links(*a.build.form_factors), flat_links(*b.build.form_factors));
  EXPECT_EQ(a.build.sky_visibility, b.build.sky_visibility);
  EXPECT_EQ(a.build.absorbed, b.build.absorbed);
  EXPECT_EQ(a.build.sky_cells.entry_begin, b.build.sky_cells.entry_begin);
  EXPECT_EQ(a.build.sky_cells.entry_cell, b.build.sky_cells.entry_cell);
  EXPECT_EQ(a.build.sky_cells.entry_part, b.build.sky_cells.entry_part);
  EXPECT_EQ(a.decided.form_factors.link_epsilon, b.decided.form_factors.link_epsilon);
  EXPECT_EQ(a.report.ray_count, b.report.ray_count);
  EXPECT_EQ(a.report.pair_count, b.report.pair_count);
  EXPECT_EQ(a.report.link_count, b.report.link_count);
  EXPECT_EQ(a.report.closure.row_sum_error_before, b.report.closure.row_sum_error_before);
  EXPECT_EQ(a.report.closure.row_sum_error_after, b.report.closure.row_sum_error_after);
  EXPECT_EQ(a.report.closure.relative_change, b.report.closure.relative_change);
}

TEST(LinkStage, GoesOnFromItsCheckpointWithTheSameBits) {
  const test::TemporaryFolder folder;
  BuildSettings settings = from_links(kCoarseLinks);
  const Found uninterrupted(settings);
  settings.checkpoint = folder.path();
  const Found first(settings), again(settings);
  EXPECT_GE(first.phases("finer links"), 1);
  EXPECT_TRUE(again.report.seconds.empty()) << "links were found anew";
  expect_same(first, uninterrupted);
  expect_same(again, uninterrupted);
}

TEST(LinkStage, FindsLinksAnewForOtherSettingsAndWhereTheCheckpointIsDamaged) {
  const test::TemporaryFolder folder;
  BuildSettings settings = from_links(kCoarseLinks);
  settings.checkpoint = folder.path();
  const Found first(settings, false);
  BuildSettings other = settings;
  other.form_factors.seed = 2;
  EXPECT_EQ(Found(other, false).phases("form factors"), 1);
  EXPECT_EQ(Found(settings, true).phases("form factors"), 1) << "judged";
  EXPECT_EQ(Found(settings, true).phases("form factors"), 0);
  std::filesystem::resize_file(folder / "links", 1000);
  const Found anew(settings, false);
  EXPECT_EQ(anew.phases("form factors"), 1);
  expect_same(anew, first);
}

TEST(LinkStage, KeepsLinksUnlessTheMemoryLimitMeansOthers) {
  const test::TemporaryFolder folder;
  BuildSettings settings = from_links(kCoarseLinks);
  settings.checkpoint = folder.path();
  settings.memory_limit_bytes = 1;
  const Found stopped(settings);
  settings.memory_limit_bytes = 2;
  EXPECT_TRUE(Found(settings).report.seconds.empty()) << "finer ones do not fit either";
  settings.memory_limit_bytes = std::uint64_t{1} << 40U;
  const Found finer(settings);
  EXPECT_EQ(finer.phases("form factors"), 1);
  EXPECT_GE(finer.phases("finer links"), 1);
  settings.memory_limit_bytes = std::uint64_t{1} << 50U;
  EXPECT_TRUE(Found(settings).report.seconds.empty()) << "they need no more";
}

TEST(LinkStage, RefusesACheckpointOfPairs) {
  const test::TemporaryFolder folder;
  BuildSettings settings;
  settings.exchange_source = ExchangeSource::kPairs;
  settings.checkpoint = folder / "parts";
  test::expect_error([&] { Found found(settings); }, "--checkpoint");
  EXPECT_FALSE(std::filesystem::exists(folder / "parts"));
}

TEST(LinkStage, GivesPatchesAndMeshBack) {
  const Found found(from_links(kCoarseLinks));
  EXPECT_NEAR(static_cast<double>(found.model.patches.size()), kPatchCount, kPatchCount / 4.0);
  EXPECT_EQ(found.build.sky_visibility.size(), found.model.patches.size());
  EXPECT_FALSE(found.model.mesh.position.empty());
  EXPECT_EQ(found.data.patches.size(), 0U);
  EXPECT_TRUE(found.data.mesh.position.empty());
}

}  // namespace
}  // namespace rebounce::test_link_stage

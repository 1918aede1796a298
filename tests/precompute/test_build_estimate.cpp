// What a build from links is said to take, against builds that were measured.

#include "build_estimate.h"

#include <gtest/gtest.h>
#include <omp.h>

#include "expect_error.h"
#include "rebounce/precompute/patch_selection.h"

namespace rebounce {
namespace {

constexpr std::uint64_t kPlenty = 1ULL << 40;

/// Of one processor, whatever this machine has.
double processor_seconds(const CostEstimate& estimate) {
  return estimate.seconds * omp_get_max_threads();
}

struct Measured {
  const char* scene;
  LinkedBuild build;
  double seconds;  ///< of processors; notes/links.md, notes/operator.md
};

/// The first patches are receivers, the last sources.
PatchRoles roles(std::size_t patch_count, std::size_t receivers, std::size_t sources) {
  PatchRoles roles;
  for (std::size_t i = 0; i < patch_count; ++i) {
    const int role = (i < receivers ? PatchRoles::kReceiver : 0) |
                     (i + sources >= patch_count ? PatchRoles::kSource : 0);
    roles.role.push_back(static_cast<std::uint8_t>(role));
  }
  return roles;
}

void expect_near(double estimate, double measured) {
  EXPECT_LT(estimate, 1.5 * measured);
  EXPECT_GT(estimate, measured / 1.5);
}

TEST(BuildEstimate, OfLinksIsThatOfMeasuredBuilds) {
  for (const auto& [scene, build, seconds] :
       {Measured{
            "white room", {.patch_count = 4000, .link_count = 188'190, .matrix_count = 1}, 4.2},
        Measured{
            "white room", {.patch_count = 64000, .link_count = 2'900'000, .matrix_count = 1}, 86},
        Measured{
            "white room", {.patch_count = 12000, .link_count = 496'530, .matrix_count = 1}, 13.2},
        Measured{"furnished room",
                 {.patch_count = 4000, .link_count = 663'316, .matrix_count = 3},
                 13.1}}) {
    SCOPED_TRACE(scene);
    expect_near(processor_seconds(estimate_links(build)), seconds);
  }
}

TEST(BuildEstimate, OfTheRestIsThatOfMeasuredBuildsOnceLinksAreKnown) {
  for (const auto& [scene, build, seconds] :
       {Measured{
            "white room", {.patch_count = 4000, .link_count = 188'190, .matrix_count = 1}, 33.8},
        Measured{
            "white room", {.patch_count = 12000, .link_count = 496'587, .matrix_count = 1}, 123},
        Measured{"furnished room",
                 {.patch_count = 4000, .link_count = 667'058, .matrix_count = 3},
                 43.4},
        Measured{"furnished room",
                 {.patch_count = 16000, .link_count = 3'606'294, .matrix_count = 3},
                 414},
        Measured{"furnished room",
                 {.patch_count = 64000, .link_count = 25'668'637, .matrix_count = 3},
                 3830}}) {
    SCOPED_TRACE(scene);
    expect_near(processor_seconds(estimate_operator_from_links(build, kPlenty)), seconds);
  }
}

TEST(BuildEstimate, TakesTheMemoryThatIsLeft) {
  const LinkedBuild build{.patch_count = 64000, .link_count = 20'000'000, .matrix_count = 3};
  const int before = omp_get_max_threads();
  omp_set_num_threads(8);
  const CostEstimate free = estimate_operator_from_links(build, kPlenty),
                     least = estimate_operator_from_links(build, 1),
                     between = estimate_operator_from_links(
                         build, (free.peak_bytes + least.peak_bytes) / 2);
  omp_set_num_threads(before);
  EXPECT_LT(least.peak_bytes, between.peak_bytes);
  EXPECT_LE(between.peak_bytes, (free.peak_bytes + least.peak_bytes) / 2);
  EXPECT_LT(between.peak_bytes, free.peak_bytes);
  EXPECT_GT(least.seconds, between.seconds);
  EXPECT_GT(between.seconds, free.seconds);
  EXPECT_EQ(memory_of_large_transfer(build, 1), 1U);
  EXPECT_EQ(memory_of_large_transfer(build, kPlenty) + 1,
            memory_of_large_transfer(build, kPlenty + 1));
  refuse_if_too_large(least, least.peak_bytes, 12);
  test::expect_error([&] { refuse_if_too_large(least, least.peak_bytes - 1, 12); },
                     "64000 patches (from 12 triangles) need about ");
}

TEST(BuildEstimate, OfMemoryIsAboveWhatBuildsTookAndNotFarAbove) {
  struct Peak {
    LinkedBuild build;
    int threads;
    double bytes;  ///< notes/operator.md
  };
  const int before = omp_get_max_threads();
  for (const Peak& peak :
       {Peak{{.patch_count = 4000, .link_count = 188'190, .matrix_count = 1}, 1, 234.0e6},
        Peak{{.patch_count = 4000, .link_count = 188'190, .matrix_count = 1}, 2, 254.7e6},
        Peak{{.patch_count = 8000, .link_count = 352'216, .matrix_count = 1}, 2, 464.2e6},
        Peak{{.patch_count = 12000, .link_count = 496'587, .matrix_count = 1}, 2, 732.7e6},
        Peak{{.patch_count = 4000, .link_count = 667'058, .matrix_count = 3}, 2, 367.5e6},
        Peak{{.patch_count = 64000, .link_count = 25'668'637, .matrix_count = 3}, 2, 6974e6}}) {
    omp_set_num_threads(peak.threads);
    const auto estimate =
        static_cast<double>(estimate_operator_from_links(peak.build, kPlenty).peak_bytes);
    EXPECT_GT(estimate, 1.1 * peak.bytes);
    EXPECT_LT(estimate, 1.32 * peak.bytes);
  }
  omp_set_num_threads(before);
}

TEST(BuildEstimate, FallsWithReceiversAndSourcesWhereTheWorkDoes) {
  const std::size_t n = 30000;
  const LinkedBuild whole{.patch_count = n, .link_count = 2'000'000, .matrix_count = 3};
  const CostEstimate all = estimate_operator_from_links(whole, kPlenty);
  EXPECT_EQ(all.receiver_count, n);
  EXPECT_EQ(all.source_count, n);
  double last = all.seconds;
  for (const auto& [receivers, sources] :
       {std::pair(n, n / 2), std::pair(n / 2, n / 2), std::pair(n / 8, n / 8)}) {
    LinkedBuild part = whole;
    part.roles = roles(n, receivers, sources);
    const CostEstimate some = estimate_operator_from_links(part, kPlenty);
    EXPECT_EQ(some.receiver_count, receivers);
    EXPECT_EQ(some.source_count, sources);
    EXPECT_EQ(some.whole_seconds, all.whole_seconds) << "lights and their truths are the same";
    EXPECT_LT(some.seconds, last);
    EXPECT_GT(some.seconds, some.whole_seconds);
    EXPECT_LT(some.peak_bytes, all.peak_bytes);
    last = some.seconds;
  }
}

TEST(WantedPart, CountsPairsThatWantLightBothWaysOnce) {
  EXPECT_EQ(wanted_part({}, 8), 1);
  EXPECT_EQ(wanted_part(roles(8, 8, 8), 8), 1);
  EXPECT_NEAR(wanted_part(roles(8, 4, 4), 8), 0.5, 1e-12) << "from one half to the other";
  EXPECT_NEAR(wanted_part(roles(8, 4, 8), 8), 0.75, 1e-12);
  PatchRoles quarter = roles(8, 2, 0);
  for (std::uint8_t& role : quarter.role) role = role != 0 ? PatchRoles::kBoth : 0;
  EXPECT_NEAR(wanted_part(quarter, 8), 1.0 / 16, 1e-12);
}

TEST(BuildEstimate, GrowsWithEverything) {
  const LinkedBuild build{.patch_count = 30000, .link_count = 5'000'000, .matrix_count = 1};
  const auto seconds = [](const LinkedBuild& b) {
    return processor_seconds(estimate_operator_from_links(b, kPlenty));
  };
  LinkedBuild larger = build, denser = build, coloured = build, open = build;
  larger.patch_count *= 2;
  denser.link_count *= 2;
  coloured.matrix_count = 3;
  open.open = true;
  for (const LinkedBuild& other : {larger, denser, coloured, open}) {
    EXPECT_GT(seconds(other), 1.02 * seconds(build));
  }
}

}  // namespace
}  // namespace rebounce

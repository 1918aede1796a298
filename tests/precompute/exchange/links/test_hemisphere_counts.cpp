// What hemisphere rays meet, as it is kept, against the rays themselves.

#include "precompute/exchange/links/hemisphere_counts.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "runtime/rays/sampling.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_hemisphere_counts {
namespace {

constexpr int kRays = 500;
constexpr std::uint64_t kSeed = 3;

using Counts = std::map<std::uint32_t, std::uint32_t>;

class HemisphereCountsOfRoom : public testing::Test {
 protected:
  /// What `ray_count` rays of patch i meet.
  Counts traced(std::uint32_t i, int ray_count, std::uint64_t seed) const {
    const PatchTriangles triangles(model_.mesh.triangle_patch, model_.patches.size());
    EscapeScratch scratch;
    measure_escape(model_.mesh, model_.shown_patch, triangles[i], i, tracer_, ray_count, seed,
                   scratch);
    Counts counts;
    for (const std::uint32_t patch : scratch.met) {
      if (patch != kNone) ++counts[patch];
    }
    return counts;
  }

  static std::vector<Counts> kept(const HemisphereCounts& hemispheres, std::size_t patch_count) {
    std::vector<Counts> counts(patch_count);
    hemispheres.for_each_patch([&](std::uint32_t i, std::span<const MetPatch> met) {
      for (const MetPatch& m : met) counts[i][m.patch] += m.count;
    });
    return counts;
  }

  const PatchModel model_ =
      make_patch_model(test::room_with_block({0.5F, 0.5F, 0.5F}), {.patch_count = 300});
  const RayTracer tracer_ = test::make_tracer(model_);
};

TEST_F(HemisphereCountsOfRoom, KeepWhatRaysMeet) {
  const std::size_t n = model_.patches.size();
  HemisphereCounts hemispheres(model_, tracer_, kRays, kSeed);
  hemispheres.trace({});
  const std::vector<Counts> counts = kept(hemispheres, n);
  std::uint64_t met = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    EXPECT_EQ(counts[i], traced(i, kRays, kSeed)) << "patch " << i;
    for (const auto& [patch, count] : counts[i]) met += count;
  }
  EXPECT_GT(met, n * kRays / 2);
  EXPECT_EQ(hemispheres.traced_rays(), n * kRays);
  EXPECT_GT(hemispheres.held_bytes(), 0U);
}

TEST_F(HemisphereCountsOfRoom, FurtherRaysCountBesideTheFirst) {
  const std::size_t n = model_.patches.size();
  HemisphereCounts hemispheres(model_, tracer_, kRays, kSeed);
  hemispheres.trace({});
  std::vector<double> more(n, 0.0);
  more[7] = 2 * kRays;
  EXPECT_TRUE(hemispheres.trace_further(more, {}));
  Counts expected = traced(7, kRays, kSeed);
  for (const auto& [patch, count] : traced(7, 2 * kRays, mix_bits(kSeed))) expected[patch] += count;
  EXPECT_EQ(kept(hemispheres, n)[7], expected);
  EXPECT_EQ(kept(hemispheres, n)[8], traced(8, kRays, kSeed));
  EXPECT_EQ(hemispheres.rays()[7], 3 * kRays);
  // As many are there already.
  more[7] = kRays;
  EXPECT_FALSE(hemispheres.trace_further(more, {}));
  EXPECT_EQ(kept(hemispheres, n)[7], expected);
}

}  // namespace
}  // namespace rebounce::test_hemisphere_counts

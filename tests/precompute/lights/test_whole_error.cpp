// The error against exact form factors that rays tell, beside that against all pairs.

#include "precompute/lights/whole_error.h"

#include <gtest/gtest.h>

#include <optional>
#include <utility>
#include <vector>

#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_solution.h"
#include "rebounce/error.h"
#include "tests/support/scene_data.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_whole_error {
namespace {

using Irradiances = std::vector<std::vector<Float3>>;

constexpr std::uint64_t kSeed = 20261125;
constexpr int kLights = 12;

// Links that are several times coarser than those of builds are off by some percent.
constexpr double kCoarseLinks = 1e-2;

// Form factors of pairs are themselves off by 0.3 % at most (notes/concepts/errors.md).
constexpr double kErrorOfPairs = 0.003;

/// A room with a block, and the light of coarse links and of all pairs in it.
class WholeErrorOfRoom : public testing::Test {
 protected:
  WholeErrorOfRoom() {
    Scene scene = test::empty_scene({0.7F, 0.5F, 0.3F});
    test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
    test::add_box(scene, {1, 0, 1}, {2, 1.2, 2.5}, false);
    PatchModel model = make_patch_model(scene, {.patch_count = 300});
    tracer_.emplace(test::make_tracer(model));
    FormFactorSettings settings;
    FormFactors pairs = compute_form_factors(model, *tracer_, settings);
    const auto links = LinkBuilder(model, *tracer_, settings).build(kCoarseLinks).form_factors;
    shown_patch_ = model.shown_patch;
    data_ = test::data_of(std::move(model), pairs);
    reference_.emplace(links, data_.patches);
    lights_ = random_initial_exitances(data_, *tracer_, LightKind::kPoint, kLights, kSeed);
    of_links_ = reference_->indirect_irradiances(lights_);
    of_pairs_ = ReferenceSolver(pairs.exchange, data_.patches).indirect_irradiances(lights_);
  }

  /// The estimate, where `truth` is what the links give and `result` what the operator gives.
  WholeError estimate(const Irradiances& truth, const Irradiances& result,
                      const WholeErrorEstimator::Sample& sample = {},
                      const PatchRoles& roles = {}) const {
    WholeErrorEstimator estimator(data_, roles, kSeed, sample);
    for (std::size_t k = 0; k < lights_.size(); ++k) {
      std::vector<Float3> received = result[k];
      roles.keep(PatchRoles::kReceiver, received);
      estimator.add(lights_[k], truth[k], received);
    }
    return estimator.estimate(shown_patch_, *tracer_, transfer());
  }

  IrradiancesOf transfer() const {
    return [this](std::span<const std::vector<Float3>> lights) {
      return reference_->indirect_irradiances(lights, WholeErrorEstimator::kSpreadResidual);
    };
  }

  /// Means of the errors of `light` against all pairs.
  double error(const Irradiances& light) const {
    double sum = 0;
    for (std::size_t k = 0; k < light.size(); ++k) {
      sum += relative_difference(light[k], of_pairs_[k], data_.patches.area);
    }
    return sum / static_cast<double>(light.size());
  }

  /// The light of an operator that loses a part of what links give on every second patch.
  Irradiances lossy() const {
    Irradiances result = of_links_;
    for (std::vector<Float3>& light : result) {
      for (std::size_t i = 0; i < light.size(); i += 2) {
        for (float& channel : light[i]) channel *= 0.96F;
      }
    }
    return result;
  }

  std::optional<RayTracer> tracer_;
  TransferData data_;
  std::vector<std::uint32_t> shown_patch_;
  std::optional<ReferenceSolver> reference_;
  Irradiances lights_, of_links_, of_pairs_;
};

TEST_F(WholeErrorOfRoom, IsThatAgainstAllPairsWithinItsConfidence) {
  const Irradiances operator_light = lossy();
  const double links = error(of_links_), whole = error(operator_light);
  ASSERT_GT(links, 4 * kErrorOfPairs) << "coarse links are not worse than pairs";
  ASSERT_GT(whole, 1.3 * links) << "the operator loses next to nothing";
  const WholeError said = estimate(of_links_, operator_light);
  EXPECT_EQ(said.light_count, kLights);
  EXPECT_NEAR(said.links.mean, links, said.links.mean_confidence + kErrorOfPairs);
  EXPECT_NEAR(said.whole.mean, whole, said.whole.mean_confidence + kErrorOfPairs);
  EXPECT_LT(said.whole.mean_confidence, 0.2 * whole);
  EXPECT_GT(said.whole.max, said.whole.mean);
}

TEST(WholeErrorSample, FewPatchesGetMoreRays) {
  const auto rays = [](std::size_t n) { return WholeErrorEstimator::sample_for(n).ray_count; };
  EXPECT_EQ(rays(100), 4096);
  EXPECT_EQ(rays(4096), 2048);
  EXPECT_EQ(rays(8192), 1024);
  EXPECT_EQ(rays(65536), 512);
  EXPECT_EQ(rays(1'000'000), 512);
}

TEST_F(WholeErrorOfRoom, TheNoiseOfRaysIsNoError) {
  // Few rays: a row by itself is some percent off.
  const WholeError said = estimate(of_pairs_, of_pairs_, {.ray_count = 256});
  EXPECT_LT(said.links.mean, kErrorOfPairs + said.links.mean_confidence);
  EXPECT_LT(said.links.mean, 2 * kErrorOfPairs);
  EXPECT_EQ(said.links.mean, said.whole.mean);
}

TEST_F(WholeErrorOfRoom, AFewPatchesTellTheSame) {
  const WholeError all = estimate(of_links_, lossy()),
                   few = estimate(of_links_, lossy(), {.patch_count = 100});
  EXPECT_GT(few.links.mean_confidence, all.links.mean_confidence);
  EXPECT_NEAR(few.whole.mean, all.whole.mean,
              few.whole.mean_confidence + all.whole.mean_confidence);
}

TEST_F(WholeErrorOfRoom, IsThatAtReceivers) {
  PatchRoles roles;
  roles.role.assign(data_.patches.size(), PatchRoles::kBoth);
  for (std::size_t i = 1; i < roles.role.size(); i += 2) roles.role[i] = PatchRoles::kSource;
  const WholeError said = estimate(of_links_, lossy(), {}, roles);
  // Every receiver loses 4 % in the same direction, against the sum of what links are off.
  EXPECT_NEAR(said.whole.mean, 0.04, said.links.mean + said.whole.mean_confidence);
  EXPECT_GT(said.whole.mean, estimate(of_links_, lossy()).whole.mean);
}

TEST_F(WholeErrorOfRoom, ALightThatLinksMissIsOffByAllOfIt) {
  constexpr float kFound = 0.02F;
  Irradiances missed = of_pairs_;
  for (std::vector<Float3>& light : missed) {
    for (Float3& irradiance : light) {
      for (float& channel : irradiance) channel *= kFound;
    }
  }
  const WholeError said = estimate(missed, missed);
  const double found = kFound, missing = 1 - found;
  EXPECT_NEAR(said.links.mean, missing / (missing - found), 2 * kErrorOfPairs);
  EXPECT_NEAR(said.links.max, said.links.mean, 4 * kErrorOfPairs);
}

TEST_F(WholeErrorOfRoom, HasTheSameBitsForAnyThreadsAndStopsWhenAsked) {
  const auto made = [&] { return estimate(of_links_, lossy()); };
  const WholeError one = test::with_threads(1, made), three = test::with_threads(3, made);
  EXPECT_EQ(one.links.mean, three.links.mean);
  EXPECT_EQ(one.whole.mean_confidence, three.whole.mean_confidence);
  EXPECT_EQ(one.whole.max, three.whole.max);
  WholeErrorEstimator estimator(data_, {}, kSeed, {});
  estimator.add(lights_[0], of_links_[0], of_links_[0]);
  EXPECT_THROW(estimator.estimate(shown_patch_, *tracer_, transfer(), [](double) { return false; }),
               Cancelled);
}

}  // namespace
}  // namespace rebounce::test_whole_error

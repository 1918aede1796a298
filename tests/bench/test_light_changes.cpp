#include "bench/support/light_changes.h"

#include <gtest/gtest.h>

#include "precompute/build/transfer_build.h"
#include "precompute/lights/reference_solution.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/reflection.h"

namespace rebounce::bench::test_light_changes {
namespace {

TEST(LampOfType, ShinesTowardsItsTargetWithOneCandela) {
  Light place;
  place.position = {1, 2, 3};
  const Light disc = lamp_of_type(LightType::kDisc, place, {1, 0, 3}, 10);
  EXPECT_EQ(disc.direction, (Float3{0, -1, 0}));
  EXPECT_NEAR(disc.intensity * 3.14159265F * disc.radius * disc.radius, 1, 1e-5);
  const Light rectangle = lamp_of_type(LightType::kRectangle, place, {5, 2, 3}, 10);
  EXPECT_EQ(rectangle.direction, (Float3{1, 0, 0}));
  EXPECT_NEAR(rectangle.intensity * rectangle.size[0] * rectangle.size[1], 1, 1e-5);
  const Light spot = lamp_of_type(LightType::kSpot, place, place.position, 10);
  EXPECT_EQ(spot.direction, place.direction) << "a target at its place has no direction";
}

TEST(MovingLamps, OnlyTheFirstChangeBetweenTwoPlaces) {
  const auto at = [](float x) {
    Light lamp;
    lamp.position = {x, 0, 0};
    return lamp;
  };
  MovingLamps moving{{at(1), at(2), at(3)}, {at(4), at(5)}};
  for (const std::array<float, 3> places : {std::array{4.0F, 5.0F, 3.0F}, {1.0F, 2.0F, 3.0F}}) {
    const std::span<const Light> lamps = moving.next();
    for (std::size_t k = 0; k < places.size(); ++k) EXPECT_EQ(lamps[k].position[0], places[k]);
  }
}

TEST(LightChanges, MuchOfTheLightArrivesAtOtherSurfacesUnderAnOpenSkyToo) {
  BuildSettings settings;
  settings.subdivision.patch_count = 300;
  settings.operator_kind = OperatorKind::kNoOperator;
  settings.store_form_factors = true;
  BuildReport report;
  const TransferData data =
      build_transfer_data(REBOUNCE_SOURCE_DIR "/tests/scenes/pavilion.gltf", settings, report);
  const ReferenceSolver solver(data.exchange, data.patches);
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    const LightType type = kLampTypes[seed % kLampTypes.size()];
    for (const LightChange& change : light_changes(data, kMotions, seed, type)) {
      std::vector<Float3> reflected = solver.indirect_irradiance(change.after);
      reflect(data.patches.reflectance, reflected);
      EXPECT_GT(area_norm(reflected, data.patches.area),
                0.005 * area_norm(change.after, data.patches.area))
          << change.name << ", seed " << seed;
    }
  }
}

}  // namespace
}  // namespace rebounce::bench::test_light_changes

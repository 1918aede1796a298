// Errors of frames from their residuals, on rooms with operators of the offline stage.

#include <gtest/gtest.h>

#include "precompute/lights/random_lights.h"
#include "rebounce/solvers.h"
#include "tests/support/built_scene.h"
#include "tests/support/solved_room.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_error_estimator_on_scenes {
namespace {

/// The built scene with its form factors, and the exact operator for them.
struct Built {
  std::shared_ptr<const TransferData> data;
  std::shared_ptr<const DenseOperator> dense;

  /// With a reflectance above 0, the form factors are those of a room that is white all over, and
  /// the operator stays that of the scene.
  explicit Built(float reflectance) {
    BuildSettings settings = test::quick_settings(400);
    settings.store_form_factors = true;
    TransferData made = test::built_scene("cornell_box.gltf", settings);
    if (reflectance > 0) {
      for (Float3& rho : made.patches.reflectance) rho.fill(reflectance);
    }
    dense = build_dense_transfer(made.exchange, made.patches, Precision::kF32);
    data = std::make_shared<const TransferData>(std::move(made));
  }

  double true_error(std::span<const Float3> exitance, std::span<const Float3> indirect) const {
    return relative_difference(indirect, product(*dense, exitance), data->patches.area);
  }
};

TEST(ErrorEstimatorOnScenes, AgreesWithTheErrorAgainstTheDenseOperator) {
  const Built built(0);
  const RayTracer tracer = make_surface_tracer(built.data->mesh);
  ErrorEstimator estimator(built.data);
  int count = 0;
  for (const LightKind kind : kLightKinds) {
    for (const auto& light : random_initial_exitances(*built.data, tracer, kind, 30, 11)) {
      const std::vector<Float3> indirect = product(*built.data->transfer, light);
      const double error = built.true_error(light, indirect);
      const ErrorEstimate estimate = estimator.estimate_error(light, indirect);
      EXPECT_NEAR(estimate.error, error, 0.02 * error + 1e-6) << name(kind);
      EXPECT_LE(error, estimate.bound + 1e-6) << name(kind);
      EXPECT_LE(estimate.bound, 1.1 * error + 1e-5) << name(kind);
      ++count;
    }
  }
  EXPECT_GE(count, 90);
}

TEST(ErrorEstimatorOnScenes, TheBoundHoldsInAWhiteRoomThatTheOperatorIsNotFor) {
  const Built built(0.97F);
  const RayTracer tracer = make_surface_tracer(built.data->mesh);
  ErrorEstimator estimator(built.data);
  int count = 0;
  for (const auto& light :
       random_initial_exitances(*built.data, tracer, LightKind::kPoint, 20, 12)) {
    const std::vector<Float3> indirect = product(*built.data->transfer, light);
    const double error = built.true_error(light, indirect);
    if (error < 0.3) continue;  // a lamp within a block
    ++count;
    EXPECT_LE(error, estimator.estimate_error(light, indirect).bound);
  }
  EXPECT_GE(count, 15);
}

}  // namespace
}  // namespace rebounce::test_error_estimator_on_scenes

// Errors of frames from their residuals, on a scene made by hand whose operator is far off.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rebounce.h"
#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "rebounce/solvers.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/expect_error.h"
#include "tests/support/random_light.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scene_data.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce::test_error_estimator {
namespace {

std::vector<Float3> exact_indirect_irradiance(const std::shared_ptr<const TransferData>& data,
                                              std::span<const Float3> exitance) {
  std::vector<Float3> radiosity(exitance.size());
  solve_radiosity(data, SolveMethod::kConjugateGradient, exitance,
                  {.max_sweeps = 300, .residual = 1e-7}, radiosity);
  return gather(*make_form_factors(SolveMethod::kGathering, *data), radiosity);
}

TEST(ErrorEstimator, TheBoundHoldsWhereTheOperatorIsFarOff) {
  const auto data = test::facing_squares();
  ErrorEstimator estimator(data);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<Float3> exitance = test::random_light(data->patches.size(), seed);
    const std::vector<Float3> indirect = product(*data->transfer, exitance);
    const double error = relative_difference(indirect, exact_indirect_irradiance(data, exitance),
                                             data->patches.area);
    const ErrorEstimate estimate = estimator.estimate_error(exitance, indirect);
    ASSERT_GT(error, 0.1) << "seed " << seed;
    EXPECT_LE(error, estimate.bound) << "seed " << seed;
    EXPECT_NEAR(estimate.error, error, error * error) << "seed " << seed;
  }
}

TEST(ErrorEstimator, FindsNothingWrongWithTheSolution) {
  const auto data = test::facing_squares();
  const std::vector<Float3> exitance = test::random_light(data->patches.size(), 5);
  const ErrorEstimate estimate =
      ErrorEstimator(data).estimate_error(exitance, exact_indirect_irradiance(data, exitance));
  EXPECT_LT(estimate.error, 2e-6);
  EXPECT_LT(estimate.bound, 1e-5);
  const std::vector<Float3> dark(exitance.size(), Float3{0, 0, 0});
  EXPECT_EQ(ErrorEstimator(data).estimate_error(dark, dark).bound, 0);
}

TEST(ErrorEstimator, IsInfiniteWhereNoLightIsExpected) {
  const auto data = test::facing_squares();
  const std::vector<Float3> dark(data->patches.size(), Float3{0, 0, 0});
  const std::vector<Float3> leaked(dark.size(), Float3{1, 1, 1});
  EXPECT_TRUE(std::isinf(ErrorEstimator(data).estimate_error(dark, leaked).bound));
}

TEST(ErrorEstimator, TakesTheFrameOfAnEngineWithoutAllocating) {
  const auto data = test::facing_squares();
  Engine engine(data);
  Light lamp;
  lamp.position = {0, 1, 0};
  engine.relight({&lamp, 1}, {});
  ErrorEstimator estimator(data);
  const auto estimate = [&] {
    return estimator.estimate_error(engine.initial_exitance(), engine.indirect_irradiance());
  };
  const ErrorEstimate one = test::with_threads(1, estimate);
  const ErrorEstimate other = test::with_threads(3, estimate);
  EXPECT_EQ(one.error, other.error);
  EXPECT_EQ(one.bound, other.bound);
  EXPECT_EQ(test::count_allocations(estimate), 0);
  EXPECT_GT(one.error, 0);
}

TEST(ErrorEstimator, SaysTheSameFromC) {
  const auto data = test::facing_squares();
  DisplayMesh& mesh = data->mesh;
  mesh.base_color_texcoord.resize(mesh.position.size());
  mesh.emissive_texcoord.resize(mesh.position.size());
  mesh.vertex_color.resize(mesh.position.size());
  mesh.weight_begin.assign(mesh.position.size() + 1, 0);
  data->materials.resize(1);
  Light lamp;
  lamp.position = {0, 1, 0};
  Engine engine(data);
  engine.relight({&lamp, 1}, {});
  const ErrorEstimate expected =
      ErrorEstimator(data).estimate_error(engine.initial_exitance(), engine.indirect_irradiance());
  const test::TemporaryFolder folder;
  const std::string path = (folder / "room.safetensors").string();
  save_transfer_file(path, *data);

  rebounce_transfer* transfer = nullptr;
  rebounce_engine* c_engine = nullptr;
  rebounce_error_estimator* estimator = nullptr;
  ASSERT_EQ(rebounce_transfer_load(path.c_str(), &transfer), REBOUNCE_OK) << rebounce_last_error();
  ASSERT_EQ(rebounce_engine_create(transfer, nullptr, &c_engine), REBOUNCE_OK);
  ASSERT_EQ(rebounce_error_estimator_create(transfer, &estimator), REBOUNCE_OK);
  rebounce_light c_lamp;
  rebounce_light_init(&c_lamp);
  c_lamp.position[1] = 1;
  ASSERT_EQ(rebounce_engine_relight(c_engine, &c_lamp, 1, nullptr), REBOUNCE_OK);
  double error = -1, bound = -1;
  EXPECT_EQ(rebounce_engine_estimate_error(c_engine, estimator, &error, &bound), REBOUNCE_OK);
  EXPECT_EQ(error, expected.error);
  EXPECT_EQ(bound, expected.bound);
  EXPECT_EQ(rebounce_engine_estimate_error(c_engine, estimator, &error, nullptr), REBOUNCE_OK);
  EXPECT_EQ(rebounce_engine_estimate_error(c_engine, nullptr, &error, &bound),
            REBOUNCE_INVALID_ARGUMENT);
  rebounce_error_estimator_destroy(estimator);
  rebounce_engine_destroy(c_engine);
  rebounce_transfer_release(transfer);
}

TEST(ErrorEstimator, SaysWhatItLacks) {
  const auto data = test::facing_squares();
  const std::vector<Float3> light(data->patches.size(), Float3{1, 1, 1});
  ErrorEstimator estimator(data);
  const std::vector<Float3> few(3);
  test::expect_error([&] { estimator.estimate_error(few, light); }, "initial exitance has 3");
  test::expect_error([&] { estimator.estimate_error(light, few); }, "indirect irradiance has 3");
  std::vector<Float3> bad = light;
  bad[2][1] = std::numeric_limits<float>::quiet_NaN();
  test::expect_error([&] { estimator.estimate_error(bad, light); }, "patch 2");
  test::expect_error([&] { estimator.estimate_error(light, bad); }, "not finite");

  EXPECT_THROW(ErrorEstimator(nullptr), Error);
  test::expect_error([&] { ErrorEstimator(data, FormFactorSource::kLinks); }, "--store-links");
  data->exchange = {};
  test::expect_error([&] { ErrorEstimator{data}; }, "no form factors");
  data->transfer = nullptr;
  test::expect_error([&] { ErrorEstimator{data}; }, "no operator");
}

}  // namespace
}  // namespace rebounce::test_error_estimator

// What the check says of an operator, against lights that it has not seen.

#include "precompute/lights/measured_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/error_reference.h"
#include "precompute/lights/reference_lighting.h"
#include "tests/support/exchange_samples.h"
#include "tests/support/scene_data.h"
#include "tests/support/test_scenes.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_measured_error {
namespace {

constexpr std::uint64_t kSeed = 11, kOtherSeed = 4711;

struct Built {
  TransferData data;
  RayTracer tracer;
  std::shared_ptr<const DenseOperator> dense;
};

Built build(const Scene& scene, std::size_t patch_count) {
  PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
  RayTracer tracer = test::make_tracer(model);
  FormFactors f = compute_form_factors(model, tracer);
  TransferData data = test::data_of(std::move(model), f);
  data.exchange = std::move(f.exchange);
  auto dense = build_dense_transfer(data.exchange, data.patches, Precision::kF32);
  data.transfer = dense;
  return {std::move(data), std::move(tracer), std::move(dense)};
}

Scene room() {
  Scene scene = test::empty_scene({0.7F, 0.5F, 0.3F});
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true, 0);
  test::add_box(scene, {1, 0, 1}, {2, 1.2, 2.5}, false, 0);
  return scene;
}

/// A block under the open sky.
Scene yard() {
  Scene scene = test::empty_scene({0.6F, 0.6F, 0.6F});
  const glm::dvec3 ground[] = {{0, 0, 0}, {0, 0, 6}, {6, 0, 6}, {6, 0, 0}};
  test::add_polygon(scene, ground);
  test::add_box(scene, {2, 0, 2}, {3, 2, 3.5}, false, 0);
  return scene;
}

void compress(Built& built, double tolerance) {
  const auto lights = [&](std::uint64_t seed) {
    return random_initial_exitances(built.data, built.tracer, LightKind::kPoint, 32, seed);
  };
  const auto training = lights(kSeed + 1), validation = lights(kSeed + 2);
  built.data.transfer = build_hierarchical_transfer(
      *built.dense, built.data.patches, {training, validation}, {.tolerance = tolerance});
}

TEST(MeasuredError, AThousandOtherLightsOfEachKindStayBelowTheBound) {
  for (const bool open : {false, true}) {
    Built built = build(open ? yard() : room(), 400);
    compress(built, 0.02);
    const auto measured = measure_error(built.data, built.tracer, built.dense.get(), kSeed);
    ASSERT_EQ(measured.size(), open ? 4U : 3U);
    for (const KindError& kind : measured) {
      SCOPED_TRACE(name(kind.kind));
      const auto others =
          random_initial_exitances(built.data, built.tracer, kind.kind, 1000, kOtherSeed);
      ASSERT_GT(others.size(), 300U);  // most suns shine from below
      const std::vector<double> errors =
          ReferenceLighting(DenseMatrix(*built.dense), others).errors(*built.data.transfer);
      const double largest = std::ranges::max(errors);
      std::printf("%s: mean %.4f max %.4f bound %.4f, others at most %.4f\n",
                  std::string(name(kind.kind)).c_str(), kind.mean, kind.max, kind.bound, largest);
      EXPECT_LT(largest, kind.bound);
      EXPECT_GT(largest, 0.5 * kind.max) << "the lights are not alike";
      EXPECT_LE(kind.max, kind.bound);
      EXPECT_LE(kind.mean, kind.max);
    }
  }
}

TEST(MeasuredError, TheDenseOperatorIsJudgedByGaussSeidel) {
  const Built built = build(room(), 300);
  const auto measured = measure_error(built.data, built.tracer, nullptr, kSeed);
  ASSERT_EQ(measured.size(), 3U);
  for (const KindError& kind : measured) {
    EXPECT_GT(kind.light_count, 10);  // a spot may light nothing
    EXPECT_LE(kind.light_count, 16);
    EXPECT_GT(kind.mean, 0);
    EXPECT_LT(kind.max, 1e-5);
  }
}

TEST(MeasuredError, BothTruthsAgree) {
  Built built = build(room(), 300);
  compress(built, 0.02);
  const auto by_reference = measure_error(built.data, built.tracer, nullptr, kSeed);
  ASSERT_EQ(by_reference.size(), 3U);
  for (const KindError& kind : by_reference) {
    const auto lights = random_initial_exitances(built.data, built.tracer, kind.kind,
                                                 kind.light_count + kind.dark_count, kSeed);
    const std::vector<double> errors =
        ReferenceLighting(DenseMatrix(*built.dense), lights).errors(*built.data.transfer);
    ASSERT_EQ(errors.size(), static_cast<std::size_t>(kind.light_count));
    const double mean = std::accumulate(errors.begin(), errors.end(), 0.0) / kind.light_count;
    // The truth that is solved for is rounded to 1e-5 at most, a thousandth of the errors.
    EXPECT_NEAR(kind.mean, mean, 1e-3 * mean);
    EXPECT_NEAR(kind.max, std::ranges::max(errors), 1e-3 * kind.max);
  }
}

TEST(MeasuredError, IsTheSameOfATruthThatIsSolvedAsFarAsTheToleranceAsks) {
  constexpr double kTolerance = 0.02;
  Built built = build(room(), 300);
  compress(built, kTolerance);
  const auto by_dense = measure_error(built.data, built.tracer, built.dense.get(), kSeed);
  const ReferenceSolver solver(built.data);
  const auto truth_of = [&](std::span<const std::vector<Float3>> lights) {
    return solver.indirect_irradiances(lights, 1e-10, reference_residual(kTolerance));
  };
  const auto measured = measure_error(built.data, built.tracer, truth_of, kSeed);
  ASSERT_EQ(measured.size(), by_dense.size());
  for (std::size_t k = 0; k < measured.size(); ++k) {
    EXPECT_EQ(measured[k].light_count, by_dense[k].light_count);
    EXPECT_NEAR(measured[k].mean, by_dense[k].mean, 1e-3 * by_dense[k].mean);
    EXPECT_NEAR(measured[k].max, by_dense[k].max, 1e-3 * by_dense[k].max);
  }
}

TEST(LightErrors, AreThoseOfTheCheckWhateverTheTruthIsFoundWith) {
  Built built = build(room(), 300);
  compress(built, 0.02);
  auto lights = random_initial_exitances(built.data, built.tracer, LightKind::kPoint, 12, kSeed);
  lights.insert(lights.begin() + 3, std::vector<Float3>(lights[0].size(), Float3{0, 0, 0}));
  const ReferenceSolver reference(built.data);
  const auto by_dense = light_errors(
      built.data, lights, [&](auto some) { return products(DenseMatrix(*built.dense), some); });
  const auto by_reference = light_errors(
      built.data, lights, [&](auto some) { return reference.indirect_irradiances(some, 1e-9); });
  ASSERT_EQ(by_dense.size(), lights.size() - 1) << "one is dark";
  ASSERT_EQ(by_reference.size(), by_dense.size());
  const std::vector<double> errors =
      ReferenceLighting(DenseMatrix(*built.dense), lights).errors(*built.data.transfer);
  for (std::size_t k = 0; k < errors.size(); ++k) {
    EXPECT_NEAR(by_dense[k].error, errors[k], 1e-6 * errors[k]);
    EXPECT_NEAR(by_reference[k].error, errors[k], 1e-5);
    EXPECT_GT(by_reference[k].error, 0);
    EXPECT_NEAR(by_dense[k].arriving, by_reference[k].arriving, 1e-5);
    EXPECT_GT(by_dense[k].arriving, 0.01);
    EXPECT_LT(by_dense[k].arriving, 10);
  }
}

TEST(ReferenceLighting, LightFromWhichNothingArrivesIsLeftOut) {
  const Built built = build(room(), 200);
  // A patch that sees nothing, as the floor in a box that has no bottom.
  ExchangeMatrix exchange;
  const std::size_t n = built.data.patches.size();
  std::vector<std::uint64_t> begin(built.data.exchange.row_begin.begin(),
                                   built.data.exchange.row_begin.end());
  begin.push_back(begin.back());
  exchange.row_begin = SharedArray(std::move(begin));
  exchange.column = built.data.exchange.column;
  exchange.exchange_area = built.data.exchange.exchange_area;
  std::vector<float> area = built.data.patches.area;
  area.push_back(1);
  std::vector<std::vector<Float3>> lights(3, std::vector<Float3>(n + 1, Float3{0, 0, 0}));
  lights[1][n] = {1, 1, 1};
  lights[2][0] = {1, 1, 1};
  EXPECT_EQ(ReferenceLighting(FormFactorMatrix(exchange, area), lights).light_count(), 1U);
}

/// Three patches of 1 m², of which the last gives next to nothing to the second.
ExchangeMatrix three_patches(float first_pair, float last_pair) {
  ExchangeMatrix exchange;
  exchange.row_begin = SharedArray(std::vector<std::uint64_t>{0, 1, 2, 2});
  exchange.column = SharedArray(std::vector<std::uint32_t>{1, 2});
  exchange.exchange_area = SharedArray(std::vector<float>{first_pair, last_pair});
  return exchange;
}

TEST(FormFactorError, LeavesOutAndCountsLightsFromWhichNothingArrives) {
  PatchTable patches;
  patches.area = {1, 1, 1};
  patches.centroid.resize(3);
  const FormFactorRows exact(three_patches(0.3F, 5e-7F), patches.area);
  const auto compressed = test::dense_blocks(three_patches(0.303F, 1e-12F), patches.area);
  std::vector<std::vector<Float3>> lights(3, std::vector<Float3>(3, Float3{0, 0, 0}));
  for (std::size_t k = 0; k < 3; ++k) lights[k][k] = {1, 1, 1};
  const FormFactorError error = form_factor_error(*compressed, exact, patches, lights);
  EXPECT_EQ(error.light_count, 2);
  EXPECT_EQ(error.dark_count, 1) << "the last: all of its light is missed";
  EXPECT_NEAR(error.mean, 0.01, 1e-5);
  EXPECT_NEAR(error.max, 0.01, 1e-5);
  const FormFactorError none = form_factor_error(*compressed, exact, patches, {&lights[2], 1});
  EXPECT_EQ(none.light_count, 0);
  EXPECT_EQ(none.dark_count, 1);
  EXPECT_EQ(none.max, 0);
}

/// Without the pairs of every third patch.
ExchangeMatrix thinned(const ExchangeMatrix& exchange) {
  std::vector<std::uint64_t> row_begin{0};
  std::vector<std::uint32_t> column;
  std::vector<float> exchange_area;
  for (std::size_t i = 0; i < exchange.patch_count(); ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      if (i % 3 == 0 || exchange.column[k] % 3 == 0) continue;
      column.push_back(exchange.column[k]);
      exchange_area.push_back(exchange.exchange_area[k]);
    }
    row_begin.push_back(column.size());
  }
  return {SharedArray(std::move(row_begin)), SharedArray(std::move(column)),
          SharedArray(std::move(exchange_area))};
}

TEST(MeasuredError, LeavesOutAndCountsLightsFromWhichNothingArrives) {
  Built built = build(room(), 200);
  built.data.exchange = thinned(built.data.exchange);
  built.data.transfer =
      build_dense_transfer(built.data.exchange, built.data.patches, Precision::kF32);
  const auto measured = measure_error(built.data, built.tracer, nullptr, kSeed);
  const auto found = std::ranges::find(measured, LightKind::kPatch, &KindError::kind);
  ASSERT_NE(found, measured.end());
  EXPECT_EQ(found->light_count + found->dark_count, 16);
  EXPECT_GT(found->dark_count, 1);
  EXPECT_GT(found->light_count, 1);
  EXPECT_LT(found->max, 1e-5);
}

TEST(ErrorReference, ErrorsAreRelativeToWhatUsuallyArrives) {
  ErrorReference far, all;
  far.add(1, 2);
  far.add(0, 2);
  far.add(2, 2);
  const double usual = std::sqrt((0.25 + 0 + 1) / 3);
  EXPECT_NEAR(far.reference(0), 2 * usual, 1e-12);
  EXPECT_NEAR(far.reference(1), 2 * usual, 1e-12);
  EXPECT_EQ(far.reference(2), 2);
  EXPECT_NEAR(far.part(), std::pow(usual, 2.0 / 3), 1e-12);
  all.add(3, 3);
  all.add(1e-5, 1e-5);
  EXPECT_EQ(all.reference(1), 1e-5);
  EXPECT_EQ(all.part(), 1);
  EXPECT_EQ(all.error(0, 1.5), 0.5);
  EXPECT_NEAR(far.error(0, usual), 0.5, 1e-12);
  ErrorReference none;
  none.add(0, 0);
  EXPECT_EQ(none.error(0, 0), 0);
  EXPECT_TRUE(std::isinf(none.error(0, 1)));
}

TEST(RandomLights, AreTheSameForASeedAndOthersForAnother) {
  const Built built = build(yard(), 200);
  for (const LightKind kind : kLightKinds) {
    const auto lights = [&](std::uint64_t seed) {
      return random_initial_exitances(built.data, built.tracer, kind, 12, seed);
    };
    EXPECT_EQ(lights(1), lights(1));
    EXPECT_NE(lights(1), lights(2));
    for (const auto& light : lights(1)) EXPECT_GT(area_norm(light, built.data.patches.area), 0);
  }
}

TEST(RandomLights, SinglePatchesAreDrawnByArea) {
  const Built built = build(room(), 200);
  const auto lights =
      random_initial_exitances(built.data, built.tracer, LightKind::kPatch, 4000, kSeed);
  const std::vector<float>& area = built.data.patches.area;
  double total = 0, squares = 0, drawn = 0;
  for (const float a : area) {
    total += a;
    squares += static_cast<double>(a) * a;
  }
  for (const auto& light : lights) {
    const auto lit = std::ranges::find_if(light, [](const Float3& m) { return m[0] > 0; });
    drawn += area[lit - light.begin()];
  }
  // A patch drawn by area has this area in the mean.
  EXPECT_NEAR(drawn / static_cast<double>(lights.size()), squares / total, 0.03 * squares / total);
}

}  // namespace
}  // namespace rebounce::test_measured_error

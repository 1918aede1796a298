// The choice among product, refinement and iteration: that it is the cheapest by its own rule, and
// that what was asked for comes out whichever it is.

#include "rebounce/runtime/automatic_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "rebounce/precompute/dense_transfer.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/precompute/low_rank_transfer.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"
#include "rebounce/transfer/exchange_blocks.h"
#include "test_scenes.h"

namespace rebounce {
namespace {

constexpr double kOperatorError = 0.02;

/// A room whose operator is a poor one of low rank.
struct Room {
  PatchTable patches;
  ExchangeMatrix exchange;
  std::unique_ptr<ExchangeBlocks> form_factors;
  std::shared_ptr<const TransferOperator> transfer;

  explicit Room(const Float3& reflectance) {
    PatchModel model = make_patch_model(test::room_with_block(reflectance), {.patch_count = 300});
    exchange = compute_form_factors(model, test::make_tracer(model)).exchange;
    patches = std::move(model.patches);
    form_factors = std::make_unique<ExchangeBlocks>(exchange, patches.area);
    const auto dense = build_dense_transfer(exchange, patches, Precision::kF32);
    transfer =
        build_low_rank_transfer(*dense, exchange, {.rank = 200, .precision = Precision::kF32});
  }

  AutomaticSolver solver() const {
    return {*form_factors, {patches.area, patches.reflectance}, transfer, kOperatorError};
  }

  /// Light that falls off with the distance from a place on the floor.
  std::vector<Float3> light(float x) const {
    std::vector<Float3> exitance(patches.size());
    for (std::size_t i = 0; i < exitance.size(); ++i) {
      const Float3& c = patches.centroid[i];
      const float d = 0.3F + (c[0] - x) * (c[0] - x) + c[1] * c[1] + (c[2] - 2) * (c[2] - 2);
      exitance[i] = {1 / d, 0.5F / d, 0.2F / d};
    }
    return exitance;
  }

  /// Of the reflected light.
  double error(std::span<const Float3> radiosity, const std::vector<Float3>& light) const {
    const auto truth = ReferenceSolver(exchange, patches).radiosity(light);
    double difference = 0, reflected = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        difference += patches.area[i] * std::pow(radiosity[i][c] - truth[i][c], 2);
        reflected += patches.area[i] * std::pow(truth[i][c] - light[i][c], 2);
      }
    }
    return std::sqrt(difference / reflected);
  }
};

const Room& room() {
  static const Room made({0.7F, 0.6F, 0.4F});
  return made;
}

TEST(ChooseMethod, TakesTheProductWhereItIsExactEnoughAndCheap) {
  const MethodCosts costs{.product = 1, .gather = 2, .operator_error = 0.005, .reflectance = 0.6};
  EXPECT_EQ(choose_method(costs, 1, 0.01), AutomaticMethod::kTransfer);
  EXPECT_EQ(choose_method(costs, 0.02, 0.01), AutomaticMethod::kTransfer);
  EXPECT_EQ(choose_method(costs, 1, 1e-4), AutomaticMethod::kRefine);
}

TEST(ChooseMethod, SweepsWhereLittleChangedOrThereIsNothingElse) {
  const MethodCosts dear{.product = 50, .gather = 1, .operator_error = 1e-6, .reflectance = 0.6};
  EXPECT_EQ(choose_method(dear, 0.02, 0.01), AutomaticMethod::kGaussSeidel);
  const MethodCosts inexact{.product = 1, .gather = 1, .operator_error = 0.02, .reflectance = 0.6};
  EXPECT_EQ(choose_method(inexact, 1e-4, 5e-5), AutomaticMethod::kGaussSeidel);
  const MethodCosts none{.gather = 1, .reflectance = 0.6};
  EXPECT_EQ(choose_method(none, 0.1, 0.01), AutomaticMethod::kGaussSeidel);
  const MethodCosts bright{.gather = 1, .reflectance = 0.95};
  EXPECT_EQ(choose_method(bright, 1, 1e-3), AutomaticMethod::kConjugateGradient);
}

TEST(AutomaticSolver, KeepsTheErrorThroughJumpsAndSmallSteps) {
  std::set<AutomaticMethod> chosen;
  for (const double error : {0.05, 0.002, 1e-4}) {
    AutomaticSolver solver = room().solver();
    for (const float x : {1.0F, 3.5F, 3.5001F, 3.5002F, 0.2F}) {
      const std::vector<Float3> light = room().light(x);
      chosen.insert(solver.solve(light, error).method);
      EXPECT_LE(room().error(solver.radiosity(), light), error) << x;
    }
  }
  EXPECT_EQ(chosen, (std::set{AutomaticMethod::kTransfer, AutomaticMethod::kGaussSeidel}));
}

TEST(AutomaticSolver, RefinesAnOperatorThatIsNotExactEnough) {
  const auto half = build_dense_transfer(room().exchange, room().patches, Precision::kF16);
  AutomaticSolver solver(*room().form_factors, {room().patches.area, room().patches.reflectance},
                         half, 1e-3);
  const std::vector<Float3> light = room().light(1);
  const AutomaticSolver::Result result = solver.solve(light, 1e-5);
  EXPECT_EQ(result.method, AutomaticMethod::kRefine);
  EXPECT_LE(room().error(solver.radiosity(), light), 1e-5);
}

TEST(AutomaticSolver, LeavesTheOperatorAloneAfterRepainting) {
  Room bright({0.9F, 0.9F, 0.9F});
  AutomaticSolver solver = bright.solver();
  const std::vector<Float3> light = bright.light(1);
  EXPECT_EQ(solver.solve(light, 0.05).method, AutomaticMethod::kTransfer);
  for (Float3& rho : bright.patches.reflectance) rho = {0.3F, 0.8F, 0};
  solver.set_reflectance(bright.patches.reflectance);
  const AutomaticSolver::Result result = solver.solve(light, 0.01);
  EXPECT_GT(result.sweeps, 1);
  EXPECT_LE(bright.error(solver.radiosity(), light), 0.01);
}

TEST(AutomaticSolver, WorksWithoutAnOperatorAndGivesTheSameBits) {
  AutomaticSolver one(*room().form_factors, {room().patches.area, room().patches.reflectance},
                      nullptr, 0);
  AutomaticSolver other(*room().form_factors, {room().patches.area, room().patches.reflectance},
                        nullptr, 0);
  for (const float x : {1.0F, 1.1F}) {
    const std::vector<Float3> light = room().light(x);
    one.solve(light, 1e-3);
    other.solve(light, 1e-3);
    EXPECT_LE(room().error(one.radiosity(), light), 1e-3);
    EXPECT_TRUE(std::ranges::equal(one.radiosity(), other.radiosity()));
  }
}

TEST(AutomaticSolver, RefusesWhatMakesNoSense) {
  AutomaticSolver solver = room().solver();
  EXPECT_THROW(solver.solve(room().light(1), 0), Error);
  EXPECT_THROW(solver.solve(std::vector<Float3>(3), 0.01), Error);
  const std::vector<Float3> dark(room().patches.size(), Float3{0, 0, 0});
  solver.solve(dark, 0.01);
  EXPECT_EQ(area_norm(solver.radiosity(), room().patches.area), 0);
}

}  // namespace
}  // namespace rebounce

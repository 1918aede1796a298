// Solvers of a transfer file, which make their form factors themselves.

#include <gtest/gtest.h>

#include <algorithm>

#include "rebounce/error.h"
#include "rebounce/solvers.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_file_solver {
namespace {

TEST(FileSolver, EveryMethodFindsTheSameLight) {
  const auto data = test::facing_squares();
  const std::vector<Float3> exitance(data->patches.size(), {3, 2, 1});
  std::vector<Float3> first(exitance.size()), again(exitance.size());
  const SolveSettings exact = {.max_sweeps = 200, .residual = 1e-6};
  ASSERT_TRUE(
      solve_radiosity(data, SolveMethod::kConjugateGradient, exitance, exact, first).converged);
  for (const NamedSolveMethod& named : kSolveMethods) {
    Solver solver(data, named.method);
    EXPECT_EQ(solver.patch_count(), exitance.size());
    EXPECT_TRUE(solver.solve(exitance, exact, again).converged) << named.name;
    for (std::size_t i = 0; i < again.size(); ++i) EXPECT_NEAR(again[i][1], first[i][1], 1e-4F);
    EXPECT_TRUE(std::ranges::equal(again, solver.radiosity()));
    solver.reset();
    solver.solve(exitance, exact);
    EXPECT_TRUE(std::ranges::equal(again, solver.radiosity())) << named.name;
  }
}

TEST(FileSolver, SaysWhatAFileHasNot) {
  const auto data = test::facing_squares();
  const auto make = [&](FormFactorSource source) { Solver(data, SolveMethod::kJacobi, source); };
  EXPECT_NO_THROW(make(FormFactorSource::kExact));
  test::expect_error([&] { make(FormFactorSource::kLinks); }, "--store-links");
  test::expect_error([&] { make(FormFactorSource::kCompressed); }, "--compress-form-factors");
  data->exchange = {};
  test::expect_error([&] { make(FormFactorSource::kBest); }, "no form factors");
  EXPECT_THROW(Solver(nullptr, SolveMethod::kJacobi), Error);
}

TEST(FileSolver, WhatArrivesFromEmittersNeedsFormFactorsOrAnOperator) {
  const auto data = test::facing_squares();
  EXPECT_TRUE(irradiance_from_emitters(*data).empty());
  data->patches.emitted_exitance[0] = {3, 2, 0};
  EXPECT_EQ(irradiance_from_emitters(*data).size(), data->patches.size());
  data->exchange = {};
  data->transfer = nullptr;
  test::expect_error([&] { irradiance_from_emitters(*data); }, "no form factors");
}

}  // namespace
}  // namespace rebounce::test_file_solver

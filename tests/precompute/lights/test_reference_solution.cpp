// The truth that everything is measured against: that it solves its equation, in double precision,
// whatever the reflectances, and that lights which are solved together do not see each other.

#include "precompute/lights/reference_solution.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "rebounce/error.h"
#include "tests/support/exchange_samples.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_reference_solution {
namespace {

using Double3 = ReferenceSolver::Double3;

constexpr std::uint32_t kSeed = 20261120;

struct Room {
  PatchTable patches;
  ExchangeMatrix exchange;

  /// Walls and a block; every fifth patch is black.
  explicit Room(const Float3& reflectance) {
    PatchModel model = make_patch_model(test::room_with_block(reflectance), {.patch_count = 300});
    exchange = compute_form_factors(model, test::make_tracer(model)).exchange;
    patches = std::move(model.patches);
    for (std::size_t i = 0; i < patches.size(); i += 5) patches.reflectance[i] = {0, 0, 0};
  }

  /// The largest residual of any light's channel, relative to its light, straight from the matrix.
  double residual(const std::vector<Float3>& light, const std::vector<Double3>& b) const {
    const FormFactorRows rows(exchange, patches.area);
    double left = 0, all = 0;
    for (std::size_t i = 0; i < b.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        double h = 0;
        for (std::size_t k = 0; k < rows.columns(i).size(); ++k) {
          h += static_cast<double>(rows.form_factors(i)[k]) * b[rows.columns(i)[k]][c];
        }
        const double r = light[i][c] + patches.reflectance[i][c] * h - b[i][c];
        left += patches.area[i] * r * r;
        all += static_cast<double>(patches.area[i]) * light[i][c] * light[i][c];
      }
    }
    return std::sqrt(left / all);
  }

  /// Lights of random strength, most patches dark; green is dark in every second one.
  std::vector<std::vector<Float3>> lights(int count) const {
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<std::vector<Float3>> result(count, std::vector<Float3>(patches.size()));
    for (int k = 0; k < count; ++k) {
      for (Float3& m0 : result[k]) {
        if (uniform(random) < 0.1F) m0 = {uniform(random), k % 2 * uniform(random), 1};
      }
    }
    return result;
  }
};

TEST(ReferenceSolution, SolvesTheEquationWhateverIsReflected) {
  for (const Float3& reflectance :
       {Float3{0.1F, 0.5F, 0.8F}, Float3{0.99F, 0.9F, 0}, Float3{0.9999F, 0.9999F, 0.9999F}}) {
    const Room room(reflectance);
    const auto light = room.lights(1).front();
    for (const double residual : {1e-4, 1e-10, 1e-12}) {
      const auto b = ReferenceSolver(room.exchange, room.patches).radiosity(light, residual);
      EXPECT_LE(room.residual(light, b), 1.01 * residual) << reflectance[0];
    }
  }
}

TEST(ReferenceSolution, IsThatOfCholesky) {
  const Room room({0.3F, 0.8F, 0.99F});
  const auto n = static_cast<Eigen::Index>(room.patches.size());
  const auto light = room.lights(1).front();
  const auto b = ReferenceSolver(room.exchange, room.patches).radiosity(light, 1e-13);
  for (int c = 0; c < kChannelCount; ++c) {
    // A^1/2 (I - R F R) A^-1/2 with R = rho^1/2, which B = M0 + R z is solved by.
    const FormFactorRows rows(room.exchange, room.patches.area);
    Eigen::MatrixXd f = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd root(n), area(n), m0(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < rows.columns(i).size(); ++k) {
        f(i, rows.columns(i)[k]) = rows.form_factors(i)[k];
      }
      root[i] = std::sqrt(static_cast<double>(room.patches.reflectance[i][c]));
      area[i] = std::sqrt(static_cast<double>(room.patches.area[i]));
      m0[i] = light[i][c];
    }
    const Eigen::MatrixXd g = area.asDiagonal() * f * area.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd system =
        Eigen::MatrixXd::Identity(n, n) - root.asDiagonal() * g * root.asDiagonal();
    const Eigen::VectorXd z = area.cwiseInverse().asDiagonal() *
                              system.llt().solve(root.asDiagonal() * g * area.asDiagonal() * m0);
    const Eigen::VectorXd truth = m0 + root.cwiseProduct(z);
    // The two halves of F are rounded to floats apart, and Cholesky reads one of them.
    for (Eigen::Index i = 0; i < n; ++i) ASSERT_NEAR(b[i][c], truth[i], 1e-6 * truth.maxCoeff());
  }
}

TEST(ReferenceSolution, LightsTogetherAreThoseAlone) {
  const Room room({0.7F, 0.5F, 0.9F});
  const ReferenceSolver solver(room.exchange, room.patches);
  std::vector<std::vector<Float3>> lights = room.lights(ReferenceSolver::kBatchLights + 3);
  std::ranges::fill(lights[2], Float3{0, 0, 0});
  const auto together = solver.radiosities(lights, 1e-12);
  const auto gathered = solver.indirect_irradiances(lights, 1e-12);
  ASSERT_EQ(together.size(), lights.size());
  for (std::size_t k = 0; k < lights.size(); ++k) {
    const auto alone = solver.radiosity(lights[k], 1e-12);
    const auto h = solver.indirect_irradiance(lights[k], 1e-12);
    for (std::size_t i = 0; i < alone.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        ASSERT_NEAR(together[k][i][c], alone[i][c], 1e-9);
        ASSERT_NEAR(gathered[k][i][c], h[i][c], 1e-5 * h[i][c]);
        ASSERT_NEAR(alone[i][c], lights[k][i][c] + room.patches.reflectance[i][c] * h[i][c], 1e-5);
      }
    }
  }
}

TEST(ReferenceSolution, SolvesOnLinksInDoublePrecision) {
  const Float3 reflectance = {0.9F, 0.5F, 0.1F};
  PatchModel model = make_patch_model(test::room_with_block(reflectance), {.patch_count = 300});
  const auto links =
      LinkBuilder(model, test::make_tracer(model), {}).build(kLinkEpsilon).form_factors;
  const PatchTable& patches = model.patches;
  const std::vector<Float3> light(patches.size(), Float3{1, 2, 3});
  GatheredLights<Double3> gathered;
  gathered.in = ReferenceSolver(links, patches).radiosity(light, 1e-12);
  links->gather(gathered);
  const std::vector<Double3>&b = gathered.in, &h = gathered.out;
  double left = 0, all = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      left += patches.area[i] *
              std::pow(light[i][c] + patches.reflectance[i][c] * h[i][c] - b[i][c], 2);
      all += patches.area[i] * std::pow(light[i][c], 2);
    }
  }
  EXPECT_LE(std::sqrt(left / all), 1e-11);
  // In single precision where that is enough.
  const auto truth = ReferenceSolver(links, patches).indirect_irradiance(light, 1e-12);
  for (const double residual : {1e-2, 1e-5, 1e-7}) {
    const auto found =
        ReferenceSolver(links, patches).indirect_irradiances({&light, 1}, 0, residual);
    EXPECT_LE(relative_difference(found.front(), truth, patches.area), 10 * residual);
  }
}

TEST(ReferenceSolution, SolvesOnCompressedFormFactorsToSinglePrecision) {
  const Room room({0.9F, 0.5F, 0.1F});
  TransferData data;
  data.patches = room.patches;
  data.compressed_form_factors = test::dense_blocks(room.exchange, room.patches.area);
  const ReferenceSolver exact(room.exchange, room.patches), compressed(data);
  const auto lights = room.lights(ReferenceSolver::kBatchLights + 1);
  const auto truths = exact.indirect_irradiances(lights),
             found = compressed.indirect_irradiances(lights);
  for (std::size_t k = 0; k < lights.size(); ++k) {
    EXPECT_LE(relative_difference(found[k], truths[k], room.patches.area), 1e-5);
  }
}

TEST(ReferenceSolution, WhatArrivesIsAsExactOfALightOfWhichLittleDoes) {
  const Room room({0.7F, 0.5F, 0.9F});
  const ReferenceSolver solver(room.exchange, room.patches);
  // The second shines on a patch of which hardly any light gets away.
  auto lights = room.lights(3);
  const FormFactorRows rows(room.exchange, room.patches.area);
  std::size_t closed = 0;
  double least = 1;
  for (std::size_t i = 0; i < room.patches.size(); ++i) {
    double sum = 0;
    for (const float f : rows.form_factors(i)) sum += f;
    if (sum > 0 && sum < least) {
      least = sum;
      closed = i;
    }
  }
  lights[1].assign(room.patches.size(), {0, 0, 0});
  lights[1][closed] = {1, 1, 1};
  const auto truths = solver.indirect_irradiances(lights, 1e-13);
  for (const double residual : {1e-2, 1e-5}) {
    const auto found = solver.indirect_irradiances(lights, 0, residual);
    for (std::size_t k = 0; k < lights.size(); ++k) {
      // (I - rho F)^-1 amplifies what is left by 1 / (1 - 0.9) at most.
      EXPECT_LE(relative_difference(found[k], truths[k], room.patches.area), 10 * residual)
          << "light " << k;
    }
  }
  const auto dark = solver.indirect_irradiances(
      std::vector(1, std::vector<Float3>(room.patches.size(), Float3{0, 0, 0})), 0, 1e-3);
  for (const Float3& h : dark.front()) EXPECT_EQ(h, (Float3{0, 0, 0}));
}

TEST(ReferenceSolution, SameBitsForAnyNumberOfThreads) {
  const Room room({0.7F, 0.5F, 0.9F});
  const ReferenceSolver solver(room.exchange, room.patches);
  const auto lights = room.lights(4);
  const auto make = [&] { return solver.radiosities(lights); };
  const auto one = test::with_threads(1, make), three = test::with_threads(3, make);
  EXPECT_EQ(one, three);
}

TEST(ReferenceSolution, WhatCannotConvergeIsRefused) {
  Room room({0.5F, 0.5F, 0.5F});
  const auto light = room.lights(1).front();
  room.patches.reflectance.assign(room.patches.size(), {8, 8, 8});
  EXPECT_THROW(ReferenceSolver(room.exchange, room.patches).radiosity(light), Error);
}

}  // namespace
}  // namespace rebounce::test_reference_solution

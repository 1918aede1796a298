// Light along links that solves with something near them are corrected to.

#include "precompute/lights/corrected_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <utility>

#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/matrix_free_transfer.h"
#include "precompute/exchange/links/link_fitting.h"
#include "precompute/exchange/links/links.h"
#include "precompute/lights/reference_solution.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_corrected_solver {
namespace {

using Lights = std::vector<std::vector<Float3>>;
using Exitances = std::span<const std::vector<Float3>>;

// Coarser than those of builds, so that corrections matter.
constexpr double kFormFactorTolerance = 0.01, kSolveResidual = 1e-2;

/// A room with a block, its links, and form factors that are compressed from them.
class CorrectedSolverOfRoom : public testing::Test {
 protected:
  CorrectedSolverOfRoom() : model_(make_patch_model(scene(), {.patch_count = 400})) {
    links_ = LinkBuilder(model_, test::make_tracer(model_), {}).build(kLinkEpsilon).form_factors;
    form_factors_ =
        compress_form_factors(links_, patches(), {}, fitting_lights(1), {kFormFactorTolerance});
    solved_.emplace(*form_factors_, patches(), kSolveResidual);
  }

  static Scene scene() { return test::room_with_block({0.8F, 0.6F, 0.6F}); }

  const PatchTable& patches() const { return model_.patches; }

  FittingLights fitting_lights(std::uint32_t seed) const {
    const Lights some = lights(48, seed);
    return {{some.begin(), some.begin() + 32}, {some.begin() + 32, some.end()}};
  }

  /// Lights on some patches each; the first on a single one, the last is dark.
  Lights lights(std::size_t count, std::uint32_t seed) const {
    std::mt19937 engine(seed);
    Lights lights(count, std::vector<Float3>(patches().size()));
    lights[0][engine() % patches().size()] = {1, 2, 3};
    for (std::size_t k = 1; k + 1 < count; ++k) {
      for (Float3& m : lights[k]) {
        if (engine() % 4 == 0) m = {0.5F, 1, static_cast<float>(engine() % 3)};
      }
    }
    return lights;
  }

  CorrectedSolver solver(IrradiancesOf nearly_exact) const {
    return {std::move(nearly_exact), links_, patches()};
  }

  IrradiancesOf by_compressed() const {
    return [this](Exitances some) { return solved_->indirect_irradiances(some); };
  }

  Lights truths(Exitances exitances) const {
    return ReferenceSolver(links_, patches()).indirect_irradiances(exitances, 1e-12);
  }

  double error(std::span<const Float3> light, std::span<const Float3> truth) const {
    return relative_difference(light, truth, patches().area);
  }

  const PatchModel model_;
  std::shared_ptr<const LinkedFormFactors> links_;
  std::shared_ptr<const HierarchicalOperator> form_factors_;
  std::optional<SolvedTransfer> solved_;
};

TEST_F(CorrectedSolverOfRoom, FindsTheLightOfTheLinks) {
  const Lights exitances = lights(21, 2);
  const Lights truths = this->truths(exitances);
  const Lights compressed = solved_->indirect_irradiances(exitances);
  for (const double residual : {1e-2, 1e-4, 1e-6}) {
    const Lights found = solver(by_compressed()).indirect_irradiances(exitances, {residual});
    ASSERT_EQ(found.size(), exitances.size());
    for (std::size_t k = 0; k + 1 < found.size(); ++k) {
      EXPECT_LT(error(found[k], truths[k]), residual) << "light " << k;
      EXPECT_GT(error(compressed[k], truths[k]), 2e-4) << "nothing to correct in light " << k;
    }
    for (const Float3& h : found.back()) ASSERT_EQ(h, (Float3{0, 0, 0}));
  }
}

TEST_F(CorrectedSolverOfRoom, MayBeginWithAnOperator) {
  const Lights exitances = lights(9, 5);
  const std::shared_ptr<const TransferOperator> nearly = build_matrix_free_transfer(
      *form_factors_, patches(), fitting_lights(6), {.compression = {.tolerance = 0.03}});
  const Lights truths = this->truths(exitances);
  for (const double residual : {1e-2, 1e-5}) {
    const Lights found = solver([&](Exitances some) {
                           return indirect_irradiances(*nearly, some);
                         }).indirect_irradiances(exitances, {residual});
    for (std::size_t k = 0; k + 1 < found.size(); ++k) {
      EXPECT_LT(error(found[k], truths[k]), residual) << "light " << k;
      EXPECT_GT(error(product(*nearly, exitances[k]), truths[k]), 2e-3) << "light " << k;
    }
  }
}

TEST_F(CorrectedSolverOfRoom, MayBeginWithFewerLinks) {
  const Lights exitances = lights(9, 7);
  const ReferenceSolver fewer(fit_links(links_, patches()), patches());
  const IrradiancesOf nearly_exact = [&](Exitances some) {
    return fewer.indirect_irradiances(some, 1e-3);
  };
  const Lights nearly = nearly_exact(exitances), truths = this->truths(exitances);
  const Lights found = solver(nearly_exact).indirect_irradiances(exitances, {1e-5});
  for (std::size_t k = 0; k + 1 < found.size(); ++k) {
    EXPECT_LT(error(found[k], truths[k]), 1e-5) << "light " << k;
    EXPECT_GT(error(nearly[k], truths[k]), 2e-4) << "light " << k;
  }
}

TEST_F(CorrectedSolverOfRoom, LeavesWhatCompressedFormFactorsCannotTellToTheLinks) {
  // Form factors of another room, of as many patches: no round comes nearer.
  PatchTable darker = patches();
  darker.reflectance.assign(darker.size(), {0.05F, 0.05F, 0.05F});
  const SolvedTransfer solved(*form_factors_, darker, kSolveResidual);
  const Lights exitances = lights(5, 3);
  const Lights truths = this->truths(exitances);
  const Lights found = solver([&](Exitances some) {
                         return solved.indirect_irradiances(some);
                       }).indirect_irradiances(exitances, {1e-5});
  for (std::size_t k = 0; k + 1 < found.size(); ++k) {
    EXPECT_LT(error(found[k], truths[k]), 1e-4) << "light " << k;
  }
}

TEST_F(CorrectedSolverOfRoom, HasTheSameBitsForAnyNumberOfThreads) {
  const Lights exitances = lights(12, 4);
  const auto make = [&] { return solver(by_compressed()).indirect_irradiances(exitances, {1e-4}); };
  EXPECT_EQ(test::with_threads(1, make), test::with_threads(3, make));
}

}  // namespace
}  // namespace rebounce::test_corrected_solver

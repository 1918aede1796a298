// The iterative methods on rooms with form factors of their own, against double precision.

#include <gtest/gtest.h>

#include <random>

#include "rebounce/precompute/dense_transfer.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/precompute/reference_solution.h"
#include "rebounce/runtime/solve_radiosity.h"
#include "test_scenes.h"

namespace rebounce {
namespace {

/// The relative area-weighted error of `radiosity` against the double-precision solution.
double radiosity_error(const ExchangeMatrix& exchange, const PatchTable& patches,
                       std::span<const Float3> radiosity, std::span<const Float3> m0) {
  const std::vector<ReferenceSolver::Double3> truth =
      ReferenceSolver(exchange, patches).radiosity(m0, 1e-12);
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      const double d = radiosity[i][c] - truth[i][c];
      difference += patches.area[i] * d * d;
      norm += patches.area[i] * truth[i][c] * truth[i][c];
    }
  }
  return std::sqrt(difference / norm);
}

struct Room {
  PatchTable patches;
  ExchangeMatrix exchange;
  std::unique_ptr<FormFactorBlocks> blocks;
  std::shared_ptr<const TransferOperator> transfer;

  explicit Room(const Scene& scene, std::size_t patch_count = 600) {
    PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
    exchange = compute_form_factors(model, test::make_tracer(model)).exchange;
    patches = std::move(model.patches);
    blocks = std::make_unique<FormFactorBlocks>(exchange, patches.area);
    transfer = build_dense_transfer(exchange, patches, Precision::kF32);
  }

  std::unique_ptr<RadiositySolver> solver(SolveMethod method) const {
    return make_solver(method, *blocks, {patches.area, patches.reflectance}, transfer);
  }
  double error(std::span<const Float3> radiosity, std::span<const Float3> m0) const {
    return radiosity_error(exchange, patches, radiosity, m0);
  }
};

/// Coloured walls, a black block, a bright one.
Scene furnished_room() {
  Scene scene = test::empty_scene({0.7F, 0.5F, 0.2F});
  scene.materials.resize(3, scene.materials[0]);
  scene.materials[1].base_color = {0, 0, 0};
  scene.materials[2].base_color = {0.6F, 0.8F, 0.0F};
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true, 0);
  test::add_box(scene, {1, 0, 1}, {2, 1.2, 2.5}, false, 1);
  test::add_box(scene, {2.5, 1.5, 3}, {3, 2, 4}, false, 2);
  return scene;
}

Scene bright_room() {
  Scene scene = test::empty_scene({0.9F, 0.9F, 0.9F});
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(scene, {1, 0.5, 1}, {2, 1.2, 2.5}, false);
  return scene;
}

const Room& furnished() {
  static const Room room(furnished_room());
  return room;
}

const Room& bright() {
  static const Room room(bright_room());
  return room;
}

/// As if lamps stood near a few patches; nothing else is lit.
std::vector<Float3> lamp_light(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<Float3> light(n, {0, 0, 0});
  for (int lamp = 0; lamp < 20; ++lamp) {
    light[engine() % n] = {100 * uniform(engine), 100 * uniform(engine), 100 * uniform(engine)};
  }
  return light;
}

class SolversOnScenes : public testing::TestWithParam<NamedSolveMethod> {};

INSTANTIATE_TEST_SUITE_P(Solvers, SolversOnScenes, testing::ValuesIn(kSolveMethods),
                         [](const auto& instance) {
                           std::string name(instance.param.name);
                           std::erase(name, '-');
                           return name;
                         });

TEST_P(SolversOnScenes, ReachTheReference) {
  for (const Room* room : {&furnished(), &bright()}) {
    const std::vector<Float3> m0 = lamp_light(room->patches.size(), 5);
    const auto solver = room->solver(GetParam().method);
    const SolveResult result = solver->solve(m0, {.max_sweeps = 400, .residual = 2e-7});
    EXPECT_FALSE(result.diverged);
    EXPECT_LE(result.residual, 1e-6);
    EXPECT_LE(room->error(solver->radiosity(), m0), 1e-6) << result.sweeps;
  }
}

TEST_P(SolversOnScenes, FurnaceIsUniform) {
  // Everything emits 1 and reflects 0.9: B = 10. Row sums are 1 to 1e-6, and the room multiplies
  // what they lack by 10.
  const auto solver = bright().solver(GetParam().method);
  solver->solve(std::vector<Float3>(bright().patches.size(), {1, 1, 1}),
                {.max_sweeps = 400, .residual = 1e-6});
  for (const Float3& b : solver->radiosity()) EXPECT_NEAR(b[1], 10, 10 * 1e-4);
}

TEST(RelaxationOnScenes, ContractsByTheReflectanceOrBetter) {
  const std::vector<Float3> m0 = lamp_light(bright().patches.size(), 6);
  for (const SolveMethod method :
       {SolveMethod::kGathering, SolveMethod::kJacobi, SolveMethod::kGaussSeidel,
        SolveMethod::kSymmetricGaussSeidel, SolveMethod::kSouthwell}) {
    const auto solver = bright().solver(method);
    double before = solver->solve(m0, {.max_sweeps = 1, .residual = 0}).residual;
    for (int sweep = 0; sweep < 8; ++sweep) {
      const double after = solver->solve(m0, {.max_sweeps = 1, .residual = 0}).residual;
      EXPECT_LE(after, 0.9001 * before) << static_cast<int>(method) << " " << sweep;
      before = after;
    }
  }
}

TEST_P(SolversOnScenes, RepaintedWallsAreExact) {
  // The operator is of the old colours; only the methods that use it can notice.
  const Room& room = furnished();
  std::vector<Float3> repainted = room.patches.reflectance;
  for (Float3& rho : repainted) rho = {0.9F * rho[0], 0.6F, rho[2]};
  const std::vector<Float3> m0 = lamp_light(repainted.size(), 7);
  const auto solver = room.solver(GetParam().method);
  solver->solve(m0);
  solver->set_reflectance(repainted);
  const SolveResult result = solver->solve(m0, {.max_sweeps = 400, .residual = 2e-7});
  EXPECT_FALSE(result.diverged);
  PatchTable patches = room.patches;
  patches.reflectance = repainted;
  EXPECT_LE(radiosity_error(room.exchange, patches, solver->radiosity(), m0), 1e-6);
}

TEST(RefinementOnScenes, AnOperatorOfOtherColoursNeedsAHandfulOfSteps) {
  // Y of walls that are 3 % darker.
  const Room& room = furnished();
  PatchTable darker = room.patches;
  for (Float3& rho : darker.reflectance) {
    for (float& x : rho) x *= 0.97F;
  }
  const auto transfer = build_dense_transfer(room.exchange, darker, Precision::kF32);
  const auto solver = make_solver(SolveMethod::kRefine, *room.blocks,
                                  {room.patches.area, room.patches.reflectance}, transfer);
  const std::vector<Float3> m0 = lamp_light(room.patches.size(), 8);
  const SolveResult result = solver->solve(m0, {.residual = 1e-6});
  EXPECT_TRUE(result.converged);
  EXPECT_GT(result.sweeps, 1);
  EXPECT_LE(result.sweeps, 6);
  EXPECT_LE(room.error(solver->radiosity(), m0), 1e-6);
}

TEST(RefinementOnScenes, TheExactOperatorIsOneStep) {
  const std::vector<Float3> m0 = lamp_light(furnished().patches.size(), 9);
  const SolveResult result =
      furnished().solver(SolveMethod::kRefine)->solve(m0, {.residual = 1e-5});
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.sweeps, 1);
}

}  // namespace
}  // namespace rebounce

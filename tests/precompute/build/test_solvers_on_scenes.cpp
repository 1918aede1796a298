// The iterative methods on rooms with form factors of their own, against double precision.

#include <gtest/gtest.h>

#include <random>

#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/import/import_gltf.h"
#include "precompute/lights/reference_solution.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/shared_folder.h"
#include "tests/support/solved_room.h"
#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/form_factor_blocks.h"

namespace rebounce::test_solvers_on_scenes {
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

struct Room : test::SolvedRoom {
  FormFactorBlocks blocks;

  explicit Room(const Scene& scene, std::size_t patch_count = 600)
      : SolvedRoom(scene, patch_count), blocks(exchange, patches.area) {}

  std::unique_ptr<RadiositySolver> solver(SolveMethod method) const {
    return make_solver(method, blocks, {patches.area, patches.reflectance}, dense);
  }
  double error(std::span<const Float3> radiosity, std::span<const Float3> m0) const {
    return radiosity_error(exchange, patches, radiosity, m0);
  }
};

/// Coloured walls, a black block, a bright one.
const Room& furnished() {
  static const Room room(test::furnished_room({0.7F, 0.5F, 0.2F}, {0, 0, 0}, {0.6F, 0.8F, 0.0F}));
  return room;
}

const Room& bright() {
  static const Room room(test::room_with_block({0.9F, 0.9F, 0.9F}));
  return room;
}

const Room& cornell() {
  static const Room room(import_gltf(REBOUNCE_SOURCE_DIR "/tests/scenes/cornell_box.gltf", 1));
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
  for (const Room* room : {&cornell(), &furnished(), &bright()}) {
    const std::vector<Float3> m0 = lamp_light(room->patches.size(), 5);
    const auto solver = room->solver(GetParam().method);
    const SolveResult result = solver->solve(m0, {.max_sweeps = 400, .residual = 2e-7});
    EXPECT_FALSE(result.diverged);
    EXPECT_LE(result.residual, 1e-6);
    EXPECT_LE(room->error(solver->radiosity(), m0), 1e-6) << result.sweeps;
  }
}

TEST(SolversOnSponza, AllReachTheReference) {
  const std::filesystem::path scene = test::shared_folder() / "scenes/15_sponza_crytek.glb";
  REBOUNCE_NEED_SHARED(scene);
  const Room room(import_gltf(scene, 1));
  const std::vector<Float3> m0 = lamp_light(room.patches.size(), 5);
  for (const NamedSolveMethod& named : kSolveMethods) {
    const auto solver = room.solver(named.method);
    const SolveResult result = solver->solve(m0, {.max_sweeps = 400, .residual = 2e-7});
    EXPECT_FALSE(result.diverged) << named.name;
    EXPECT_LE(room.error(solver->radiosity(), m0), 1e-6) << named.name << " " << result.sweeps;
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

TEST(RefinementOnScenes, TheExactOperatorIsOneStep) {
  const std::vector<Float3> m0 = lamp_light(furnished().patches.size(), 9);
  const SolveResult result =
      furnished().solver(SolveMethod::kRefine)->solve(m0, {.residual = 1e-5});
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.sweeps, 1);
}

/// Operators of reflectances that are `made` everywhere, in a room where they are `used`.
struct OtherReflectances {
  std::vector<Float3> reflectance;
  std::shared_ptr<const TransferOperator> transfer;

  OtherReflectances(const Room& room, float made, float used)
      : reflectance(room.patches.size(), {used, used, used}) {
    PatchTable patches = room.patches;
    for (Float3& rho : patches.reflectance) rho = {made, made, made};
    transfer = build_dense_transfer(room.exchange, patches, Precision::kF32);
  }

  std::unique_ptr<RadiositySolver> solver(const Room& room, SolveMethod method) const {
    return make_solver(method, room.blocks, {room.patches.area, reflectance}, transfer);
  }
  double error(const Room& room, std::span<const Float3> radiosity,
               std::span<const Float3> m0) const {
    PatchTable patches = room.patches;
    patches.reflectance = reflectance;
    return radiosity_error(room.exchange, patches, radiosity, m0);
  }
};

TEST(RefinementOnScenes, AnOperatorOfDarkWallsStillHelpsInABrightRoom) {
  // I + rho Y of 0.3 falls short of the inverse for 0.95 by 0.88 at most: slow, not wrong.
  const Room& room = bright();
  const OtherReflectances other(room, 0.3F, 0.95F);
  const std::vector<Float3> m0 = lamp_light(room.patches.size(), 10);
  const auto refine = other.solver(room, SolveMethod::kRefine);
  const SolveResult refined = refine->solve(m0, {.max_sweeps = 400, .residual = 1e-6});
  EXPECT_TRUE(refined.converged) << refined.residual;
  EXPECT_FALSE(refined.diverged);
  EXPECT_LE(other.error(room, refine->radiosity(), m0), 1e-5);
}

TEST(RefinementOnScenes, AnOperatorOfBrightWallsIsReportedInADarkRoom) {
  // I + rho Y of 0.95 is five times the inverse for 0.3: refinement must not return that.
  const Room& room = bright();
  const OtherReflectances other(room, 0.95F, 0.3F);
  const std::vector<Float3> m0 = lamp_light(room.patches.size(), 11);
  const auto refine = other.solver(room, SolveMethod::kRefine);
  const SolveResult refined = refine->solve(m0, {.max_sweeps = 400, .residual = 1e-6});
  EXPECT_TRUE(refined.diverged);
  EXPECT_FALSE(refined.converged);
  EXPECT_LE(refined.residual, 1);
  EXPECT_LE(other.error(room, refine->radiosity(), m0), 1);
}

TEST(RefinementOnScenes, AThreePerCentOperatorNeedsAHandfulOfSteps) {
  for (const Room* room : {&cornell(), &furnished(), &bright()}) {
    const std::size_t n = room->patches.size();
    std::vector<std::vector<Float3>> lights;
    for (std::uint64_t seed = 20; seed < 28; ++seed) lights.push_back(lamp_light(n, seed));
    const auto transfer =
        build_hierarchical_transfer(*room->dense, room->patches, {lights, lights},
                                    {.tolerance = 0.03, .precision = Precision::kF32});
    for (std::uint64_t seed = 30; seed < 34; ++seed) {
      const std::vector<Float3> m0 = lamp_light(n, seed);
      const auto solver = make_solver(SolveMethod::kRefine, room->blocks,
                                      {room->patches.area, room->patches.reflectance}, transfer);
      const SolveResult result = solver->solve(m0, {.residual = 1e-6});
      EXPECT_TRUE(result.converged) << result.residual;
      EXPECT_GT(result.sweeps, 2);
      EXPECT_LE(result.sweeps, 8);
      EXPECT_LE(room->error(solver->radiosity(), m0), 1e-6);
    }
  }
}

/// A room whose F is compressed.
struct CompressedRoom {
  const Room& room;
  std::unique_ptr<CompressedFormFactors> form_factors;

  CompressedRoom(const Room& of, double tolerance, Precision precision) : room(of) {
    const auto training = radiosities(100, 132), validation = radiosities(40, 48);
    form_factors = std::make_unique<CompressedFormFactors>(
        compress_form_factors(room.exchange, room.patches, {training, validation},
                              {.tolerance = tolerance, .precision = precision}));
  }

  /// Of the lamps with these seeds.
  std::vector<std::vector<Float3>> radiosities(std::uint64_t begin, std::uint64_t end) const {
    std::vector<std::vector<Float3>> lights;
    for (std::uint64_t seed = begin; seed < end; ++seed) {
      lights.push_back(lamp_light(room.patches.size(), seed));
    }
    return radiosities_of(*room.dense, room.patches.reflectance, lights);
  }

  std::unique_ptr<RadiositySolver> solver(SolveMethod method) const {
    return make_solver(method, *form_factors, {room.patches.area, room.patches.reflectance},
                       room.dense);
  }

  /// Jacobi in double precision on the expanded matrix.
  double error(std::span<const Float3> radiosity, std::span<const Float3> m0) const {
    const std::size_t n = m0.size();
    std::vector<float> matrix(n * n);
    form_factors->exchange().expand(0, matrix);
    double difference = 0, norm = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      std::vector<double> b(n, 0.0), next(n);
      for (int sweep = 0; sweep < 250; ++sweep) {
        for (std::size_t i = 0; i < n; ++i) {
          double sum = 0;
          for (std::size_t j = 0; j < n; ++j) sum += matrix[i * n + j] * b[j];
          next[i] = m0[i][c] + room.patches.reflectance[i][c] * sum;
        }
        b.swap(next);
      }
      for (std::size_t i = 0; i < n; ++i) {
        difference += room.patches.area[i] * std::pow(radiosity[i][c] - b[i], 2);
        norm += room.patches.area[i] * b[i] * b[i];
      }
    }
    return std::sqrt(difference / norm);
  }
};

TEST(CompressedFormFactorsOnScenes, KeepTheTolerance) {
  for (const Room* room : {&cornell(), &furnished(), &bright()}) {
    std::size_t previous = 0;
    for (const double tolerance : {0.02, 0.005, 0.001}) {
      const CompressedRoom compressed(*room, tolerance, Precision::kF16);
      EXPECT_GT(compressed.form_factors->bytes(), previous);
      previous = compressed.form_factors->bytes();
      std::vector<std::vector<Float3>> lights;
      for (std::uint64_t seed = 50; seed < 58; ++seed) {
        lights.push_back(lamp_light(room->patches.size(), seed));
      }
      double mean = 0;
      for (const auto& b : radiosities_of(*room->dense, room->patches.reflectance, lights)) {
        std::vector<Float3> exact(b.size()), gathered(b.size());
        std::vector<float> workspace(
            std::max(compressed.form_factors->workspace_size(), room->blocks.workspace_size()));
        room->blocks.gather(b, exact, workspace);
        compressed.form_factors->gather(b, gathered, workspace);
        mean += relative_difference(gathered, exact, room->patches.area) / 8;
      }
      EXPECT_LE(mean, tolerance);
    }
  }
}

TEST(CompressedFormFactorsOnScenes, AreSolvedByEveryMethod) {
  const std::vector<Float3> m0 = lamp_light(furnished().patches.size(), 12);
  for (const Precision precision : {Precision::kF32, Precision::kF16}) {
    const CompressedRoom compressed(furnished(), 0.002, precision);
    for (const NamedSolveMethod& named : kSolveMethods) {
      const auto solver = compressed.solver(named.method);
      const SolveResult result = solver->solve(m0, {.max_sweeps = 400, .residual = 2e-7});
      EXPECT_FALSE(result.diverged) << named.name;
      EXPECT_LE(compressed.error(solver->radiosity(), m0), 1e-6) << named.name;
      // Against the exact form factors: about the tolerance, times what bounces add up to.
      EXPECT_LE(furnished().error(solver->radiosity(), m0), 0.01) << named.name;
    }
  }
}

TEST(CompressedFormFactorsOnScenes, ContractByTheReflectanceOrBetter) {
  const CompressedRoom compressed(bright(), 0.002, Precision::kF16);
  const std::vector<Float3> m0 = lamp_light(bright().patches.size(), 13);
  for (const SolveMethod method :
       {SolveMethod::kGathering, SolveMethod::kGaussSeidel, SolveMethod::kSymmetricGaussSeidel}) {
    const auto solver = compressed.solver(method);
    double before = solver->solve(m0, {.max_sweeps = 1, .residual = 0}).residual;
    for (int sweep = 0; sweep < 8; ++sweep) {
      const double after = solver->solve(m0, {.max_sweeps = 1, .residual = 0}).residual;
      // The spectral radius of compressed G may be above 1 by its error.
      EXPECT_LE(after, 0.9 * 1.005 * before) << static_cast<int>(method) << " " << sweep;
      before = after;
    }
  }
}

TEST(CompressedFormFactorsOnScenes, RelaxInAboutAsManySweepsAsRows) {
  const CompressedRoom compressed(bright(), 0.002, Precision::kF16);
  const std::vector<Float3> m0 = lamp_light(bright().patches.size(), 14);
  for (const SolveMethod method : {SolveMethod::kGaussSeidel, SolveMethod::kSymmetricGaussSeidel}) {
    const SolveSettings settings = {.residual = 1e-4};
    const int by_rows = bright().solver(method)->solve(m0, settings).sweeps;
    const int by_clusters = compressed.solver(method)->solve(m0, settings).sweeps;
    EXPECT_LE(by_clusters, 1.3 * by_rows + 1);
  }
}

}  // namespace
}  // namespace rebounce::test_solvers_on_scenes

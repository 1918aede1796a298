// Builds for some receivers and sources, and what reads them.

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "precompute/build/transfer_build.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/random_lights.h"
#include "rebounce.h"
#include "rebounce/engine.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/built_scene.h"
#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"
#include "transfer/base/area_norm.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_receivers_and_sources {
namespace {

using Lights = std::vector<std::vector<Float3>>;

const std::string kTwoRooms = REBOUNCE_SOURCE_DIR "/tests/scenes/two_rooms.gltf";

/// What lamps in the first of two rooms do to the second.
BuildSettings settings_of_rooms(ExchangeSource kind) {
  BuildSettings settings = test::quick_settings(400);
  settings.exchange_source = kind;
  settings.store_form_factors = kind == ExchangeSource::kPairs;
  settings.tolerance = 0.01;
  settings.sources = {"mesh:first room", "red wall"};
  settings.receivers = {"second room", "material:blue", "table"};
  return settings;
}

struct Built {
  TransferData data;
  BuildReport report;
};

Built build(const BuildSettings& settings) {
  Built built;
  built.data = build_transfer_data(kTwoRooms, settings, built.report);
  return built;
}

const Built& rooms_from_pairs() {
  static const Built built = build(settings_of_rooms(ExchangeSource::kPairs));
  return built;
}

TEST(ReceiversAndSources, ABuildKeepsItsToleranceForThem) {
  for (const ExchangeSource kind : {ExchangeSource::kPairs, ExchangeSource::kLinks}) {
    const Built built = build(settings_of_rooms(kind));
    const TransferData& data = built.data;
    const PatchRoles& roles = data.transfer->roles();
    const std::size_t n = data.patches.size();
    for (const std::uint8_t bit : {PatchRoles::kReceiver, PatchRoles::kSource}) {
      EXPECT_GT(roles.count(bit, n), n / 10);
      EXPECT_LT(roles.count(bit, n), n / 2);
    }
    EXPECT_GT(data.record.error_mean, 0);
    EXPECT_LE(data.record.error_mean, 0.01);
    EXPECT_EQ(data.record.solve_residual, 0);
  }
}

TEST(ReceiversAndSources, AllWarningsAreInTheFile) {
  for (const ExchangeSource kind : {ExchangeSource::kPairs, ExchangeSource::kLinks}) {
    BuildSettings settings = settings_of_rooms(kind);
    settings.receiver_rows = {.at_vertices = true, .least_error = 0};
    const Built built = build(settings);
    const auto is_of_rows = [](const std::string& warning) {
      return warning.find("vertices and texels with rows") != std::string::npos;
    };
    EXPECT_EQ(std::ranges::count_if(built.report.warnings, is_of_rows), 1);
    const auto stored = nlohmann::json::parse(built.data.report_json)["warnings"];
    EXPECT_EQ(stored.get<std::vector<std::string>>(), built.report.warnings);
  }
}

TEST(ReceiversAndSources, LightGoesByWayOfAllPatches) {
  // Against the operator of all patches and not one of these alone: between the rooms light goes
  // through the door, by floors and walls that are neither.
  const TransferData& data = rooms_from_pairs().data;
  const PatchRoles& roles = data.transfer->roles();
  const auto dense = build_dense_transfer(data.exchange, data.patches, Precision::kF32);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const Lights lights =
      random_initial_exitances(data, tracer, LightKind::kPoint, 16, 20261121, roles);
  ASSERT_GT(lights.size(), 10U);
  double sum = 0;
  for (const std::vector<Float3>& light : lights) {
    std::vector<Float3> truth = product(*dense, light);
    roles.keep(PatchRoles::kReceiver, truth);
    sum += relative_difference(product(*data.transfer, light), truth, data.patches.area);
  }
  EXPECT_LT(sum / static_cast<double>(lights.size()), 0.015);
}

TEST(ReceiversAndSources, AnEngineLightsReceiversBySourcesAlone) {
  const auto data = std::make_shared<const TransferData>(rooms_from_pairs().data);
  const PatchRoles& roles = data->transfer->roles();
  Engine engine(data);
  const std::size_t n = data->patches.size();
  std::vector<Float3> direct(n, Float3{1, 1, 1});
  engine.relight(direct);
  const std::vector<Float3> lit(engine.indirect_irradiance().begin(),
                                engine.indirect_irradiance().end());
  for (std::size_t i = 0; i < n; ++i) {
    if (roles.is_receiver(i)) continue;
    EXPECT_EQ(lit[i], (Float3{0, 0, 0})) << i;
    EXPECT_EQ(engine.radiosity()[i], engine.initial_exitance()[i]) << i;
  }
  EXPECT_GT(area_norm(lit, data->patches.area), 0);
  for (std::size_t i = 0; i < n; ++i) {
    if (!roles.is_source(i)) direct[i] = {0, 0, 0};
  }
  engine.relight(direct);
  EXPECT_TRUE(std::ranges::equal(engine.indirect_irradiance(), lit));
}

TEST(ReceiversAndSources, TheInterfaceForCSaysWhichTheyAre) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "rooms", rooms_from_pairs().data);
  rebounce_transfer* transfer = nullptr;
  ASSERT_EQ(rebounce_transfer_load((folder / "rooms").c_str(), &transfer), REBOUNCE_OK);
  const std::uint8_t* role = rebounce_transfer_patch_role(transfer);
  ASSERT_NE(role, nullptr);
  EXPECT_TRUE(std::ranges::equal(std::span(role, rooms_from_pairs().data.patches.size()),
                                 rooms_from_pairs().data.transfer->roles().role));
  rebounce_transfer_release(transfer);
  EXPECT_EQ(rebounce_transfer_patch_role(nullptr), nullptr);
}

TEST(ReceiversAndSources, RefinementOfAllPatchesRefusesTheOperator) {
  const TransferData& data = rooms_from_pairs().data;
  const ExchangeBlocks form_factors(data.exchange, data.patches.area);
  const RadiosityProblem problem{data.patches.area, data.patches.reflectance};
  test::expect_error(
      [&] { make_solver(SolveMethod::kRefine, form_factors, problem, data.transfer); },
      "receivers or sources");
}

TEST(ReceiversAndSources, TheFileIsTheSameForAnyNumberOfThreads) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "usual", rooms_from_pairs().data);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(threads + 1);
  save_transfer_file(folder / "other", build(settings_of_rooms(ExchangeSource::kPairs)).data);
  omp_set_num_threads(threads);
  EXPECT_EQ(test::read_bytes(folder / "usual"), test::read_bytes(folder / "other"));
}

TEST(ReceiversAndSources, OtherOperatorsRefuseThem) {
  for (const OperatorKind kind : {OperatorKind::kDense, OperatorKind::kLowRank}) {
    BuildSettings settings = settings_of_rooms(ExchangeSource::kPairs);
    settings.operator_kind = kind;
    test::expect_error([&] { build(settings); }, "hierarchical operators alone");
  }
}

}  // namespace
}  // namespace rebounce::test_receivers_and_sources

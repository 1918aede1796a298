// Operators of the rows of receivers and the columns of sources, against those of all patches.

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

#include "precompute/build/build.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/compression/matrix_free_transfer.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/random_lights.h"
#include "precompute/patches/patch_selection.h"
#include "rebounce.h"
#include "runtime/frame/engine.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scenes.h"
#include "tests/support/unshadowed_lights.h"
#include "transfer/base/area_norm.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/file/transfer_file.h"

namespace rebounce {
namespace {

using Lights = std::vector<std::vector<Float3>>;

const std::string kTwoRooms = REBOUNCE_SOURCE_DIR "/tests/scenes/two_rooms.gltf";

/// A room of 4 x 3 x 5 m with two blocks.
struct Room {
  PatchTable patches;
  ExchangeMatrix exchange;
  std::shared_ptr<const DenseOperator> dense;
  Lights training, validation, others;
};

Room make_room(std::size_t patch_count) {
  Scene scene = test::room_with_block({0.7F, 0.5F, 0.2F});
  test::add_box(scene, {2.5, 0, 3}, {3, 1, 4}, false);
  const PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
  FormFactors f = compute_form_factors(model, test::make_tracer(model));
  Room room;
  room.patches = model.patches;
  room.exchange = std::move(f.exchange);
  room.dense = build_dense_transfer(room.exchange, room.patches, Precision::kF32);
  const auto lights = [&](int count, std::uint64_t seed) {
    return test::unshadowed_lights(room.patches, count, seed, 1.6, 1.2);
  };
  room.training = lights(16, 1);
  room.validation = lights(12, 2);
  room.others = lights(24, 3);
  return room;
}

const Room& room() {
  static const Room made = make_room(1200);
  return made;
}

using Place = std::function<bool(const Float3&)>;

bool anywhere(const Float3& /*p*/) {
  return true;
}
bool before(const Float3& p) {
  return p[2] < 2.5F;
}
bool behind(const Float3& p) {
  return p[2] >= 2.5F;
}

PatchRoles roles_at(const PatchTable& patches, const Place& receivers, const Place& sources) {
  PatchRoles roles;
  for (const Float3& p : patches.centroid) {
    const int role =
        (receivers(p) ? PatchRoles::kReceiver : 0) | (sources(p) ? PatchRoles::kSource : 0);
    roles.role.push_back(static_cast<std::uint8_t>(role));
  }
  return roles;
}

struct Choice {
  const char* name;
  Place receivers, sources;
};
const Choice kChoices[] = {{"half of both", before, before},
                           {"from one half to the other", before, behind},
                           {"half the receivers", before, anywhere},
                           {"half the sources", anywhere, behind}};

/// Y of all three channels, [3][n][n].
std::vector<float> expansion(const TransferOperator& transfer) {
  const std::size_t n = transfer.patch_count();
  std::vector<float> y(3 * n * n);
  for (int c = 0; c < kChannelCount; ++c)
    transfer.expand(c, std::span(y).subspan(c * n * n, n * n));
  return y;
}

/// Relative difference of the entries that receivers and sources share; all others must be 0.
double entry_error(const Room& room, const TransferOperator& transfer) {
  const std::size_t n = transfer.patch_count();
  const PatchRoles& roles = transfer.roles();
  const std::vector<float> a = expansion(*room.dense), b = expansion(transfer);
  double error = 0, norm = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const std::size_t i = k / n % n, j = k % n;
    if (roles.is_receiver(i) && roles.is_source(j)) {
      error += std::pow(static_cast<double>(a[k]) - b[k], 2);
      norm += std::pow(static_cast<double>(a[k]), 2);
    } else if (b[k] != 0) {
      return std::numeric_limits<double>::infinity();
    }
  }
  return std::sqrt(error / norm);
}

std::vector<Float3> product(const TransferOperator& transfer, const std::vector<Float3>& light) {
  std::vector<Float3> result(light.size());
  std::vector<float> workspace(transfer.workspace_size());
  transfer.apply(light, result, workspace);
  return result;
}

/// Of the light of sources at receivers.
double mean_error(const Room& room, const TransferOperator& transfer, const Lights& lights) {
  double sum = 0;
  for (std::vector<Float3> light : lights) {
    transfer.roles().keep(PatchRoles::kSource, light);
    std::vector<Float3> truth = product(*room.dense, light);
    transfer.roles().keep(PatchRoles::kReceiver, truth);
    sum += relative_difference(product(transfer, light), truth, room.patches.area);
  }
  return sum / static_cast<double>(lights.size());
}

TEST(ReceiversAndSources, EntriesAreThoseOfTheWholeAtALowMultiplier) {
  for (const Choice& choice : {kChoices[1], kChoices[2]}) {
    SCOPED_TRACE(choice.name);
    const PatchRoles roles = roles_at(room().patches, choice.receivers, choice.sources);
    const HierarchicalOperator transfer(
        compress_transfer(*room().dense, room().patches, room().training, 1e-16, {}, roles));
    EXPECT_EQ(transfer.roles(), roles);
    EXPECT_LT(entry_error(room(), transfer), 1e-5);
  }
}

TEST(ReceiversAndSources, NoBlockIsStoredThatTheyDoNotShare) {
  for (const Choice& choice : kChoices) {
    SCOPED_TRACE(choice.name);
    const PatchRoles roles = roles_at(room().patches, choice.receivers, choice.sources);
    const auto storage =
        compress_transfer(*room().dense, room().patches, room().training, 1e-8, {}, roles);
    const auto any = [&](std::uint32_t begin, std::uint32_t count, std::uint8_t bit) {
      const std::size_t end = std::min<std::size_t>(begin + count, storage.patch.size());
      return std::any_of(storage.patch.begin() + begin,
                         storage.patch.begin() + static_cast<std::ptrdiff_t>(end),
                         [&](std::uint32_t p) { return roles.has(p, bit); });
    };
    for (const TransferBlock& b : storage.blocks) {
      const bool to_rows = any(b.row_begin, b.row_count, PatchRoles::kReceiver) &&
                           any(b.column_begin, b.column_count, PatchRoles::kSource);
      const bool to_columns = any(b.column_begin, b.column_count, PatchRoles::kReceiver) &&
                              any(b.row_begin, b.row_count, PatchRoles::kSource);
      EXPECT_TRUE(to_rows || to_columns);
    }
  }
}

TEST(ReceiversAndSources, BytesFallInProportionAtTheSameTolerance) {
  const HierarchicalSettings settings{.tolerance = 0.005};
  const FittingLights lights{room().training, room().validation};
  const auto whole = build_hierarchical_transfer(*room().dense, room().patches, lights, settings);
  // Half of both have a quarter of all pairs, but half of the near ones, which take the most; where
  // only the receivers are fewer, reciprocity had stored what is left out but once.
  for (const auto& [choice, part] : {std::pair(kChoices[0], 0.6), std::pair(kChoices[1], 0.5),
                                     std::pair(kChoices[2], 0.85), std::pair(kChoices[3], 0.85)}) {
    SCOPED_TRACE(choice.name);
    const PatchRoles roles = roles_at(room().patches, choice.receivers, choice.sources);
    const auto some =
        build_hierarchical_transfer(*room().dense, room().patches, lights, settings, {}, roles);
    // Sixteen lights shape it, of which sources are half, and others judge.
    EXPECT_LT(mean_error(room(), *some, room().others), 1.2 * settings.tolerance);
    const double bytes = static_cast<double>(some->bytes()) / static_cast<double>(whole->bytes());
    RecordProperty(choice.name, std::to_string(bytes));
    EXPECT_LT(bytes, part);
    EXPECT_GT(bytes, 0.1);
  }
}

TEST(ReceiversAndSources, SameBitsForAnyNumberOfThreads) {
  const PatchRoles roles = roles_at(room().patches, before, anywhere);
  const auto compressed = [&](int threads) {
    const int usual = omp_get_max_threads();
    omp_set_num_threads(threads);
    auto storage =
        compress_transfer(*room().dense, room().patches, room().training, 1e-7, {}, roles);
    omp_set_num_threads(usual);
    return storage;
  };
  const auto one = compressed(1), four = compressed(4);
  EXPECT_TRUE(std::ranges::equal(one.values_f32, four.values_f32));
  EXPECT_EQ(one.patch, four.patch);
}

/// Of columns that were solved for together, in a checkpoint.
int panel_count(const std::filesystem::path& folder) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    count += entry.path().filename().string().starts_with("panel_") ? 1 : 0;
  }
  return count;
}

TEST(ReceiversAndSources, OnlyTheirColumnsAreSolvedFor) {
  const auto form_factors =
      compress_form_factors(room().exchange, room().patches, {room().training, room().validation},
                            {.tolerance = 1e-3, .precision = Precision::kF32});
  const auto build = [&](const PatchRoles& roles, const std::filesystem::path& panels) {
    MatrixFreeTransferSettings settings{.compression = {.tolerance = 0.01}};
    settings.roles = roles;
    settings.checkpoint = panels;
    return build_matrix_free_transfer(*form_factors, room().patches,
                                      {room().training, room().validation}, settings);
  };
  const test::TemporaryFolder folder;
  build({}, folder / "all");
  const auto corner = [](const Float3& p) { return p[2] < 1 && p[0] < 2; };
  for (const Choice& choice :
       {Choice{"few receivers", corner, anywhere}, Choice{"few sources", anywhere, corner}}) {
    SCOPED_TRACE(choice.name);
    const auto panels = folder / choice.name;
    const auto some = build(roles_at(room().patches, choice.receivers, choice.sources), panels);
    EXPECT_LT(panel_count(panels), panel_count(folder / "all"));
    EXPECT_LT(mean_error(room(), *some, room().others), 0.015);
  }
}

/// What lamps in the first of two rooms do to the second.
BuildSettings settings_of_rooms(ExchangeSource kind) {
  BuildSettings settings;
  settings.subdivision.patch_count = 500;
  settings.exchange_source = kind;
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

/// Two walls, of which the second is placed twice, and a lamp.
Scene named_scene() {
  Scene scene = test::empty_scene();
  scene.materials[0].name = "paint";
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].name = "lamp";
  scene.materials[1].emitted_luminance = {5, 5, 5};
  const auto add_wall = [&](double x, std::uint32_t material, std::uint32_t mesh) {
    const glm::dvec3 corner[] = {{x, 0, 0}, {x, 1, 0}, {x, 1, 1}, {x, 0, 1}};
    test::add_polygon(scene, corner, material);
    scene.triangle_mesh.resize(scene.triangle.size(), mesh);
  };
  scene.placed_meshes = {{"wall", "left"}, {"panel", "middle"}, {"panel", "right"}, {"", "lamp\n"}};
  add_wall(0, 0, 0);
  add_wall(1, 0, 1);
  add_wall(2, 0, 2);
  add_wall(3, 1, 3);
  return scene;
}

/// The x of the patches that a list selects, each once.
std::vector<float> selected_x(const std::string& list) {
  const Scene scene = named_scene();
  const PatchModel model = make_patch_model(scene, {.patch_count = 40});
  const PatchSelection selection(split_selection(list), scene, "receivers");
  const std::vector<std::uint8_t> selected = selection.patches(model);
  std::vector<float> x;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    if (selected[i] != 0) x.push_back(std::round(model.patches.centroid[i][0]));
  }
  std::ranges::sort(x);
  const auto rest = std::ranges::unique(x);
  x.erase(rest.begin(), rest.end());
  return x;
}

TEST(PatchSelection, FindsMeshesNodesMaterialsAndBoxes) {
  using X = std::vector<float>;
  EXPECT_EQ(selected_x("wall"), X{0});
  EXPECT_EQ(selected_x("panel"), (X{1, 2}));
  EXPECT_EQ(selected_x("mesh:right,left"), (X{0, 2}));
  EXPECT_EQ(selected_x("paint"), (X{0, 1, 2}));
  EXPECT_EQ(selected_x("material:lamp"), X{3});
  EXPECT_EQ(selected_x("box:0.5,-1,-1,1.5,2,2"), X{1});
  EXPECT_EQ(selected_x("wall,box:1.5,2,2,2.5,-1,-1,lamp"), (X{0, 2, 3}));
}

TEST(PatchSelection, SaysWhatIsWrong) {
  const auto attempt = [](const std::string& list) { return [list] { selected_x(list); }; };
  test::expect_error(attempt("pannel"), R"(receivers: the scene has no mesh or material "pannel"; )"
                                        R"(there are "panel", "paint")");
  test::expect_error(attempt("mesh:paint"), R"(has no mesh "paint")");
  test::expect_error(attempt("material:wall"), R"(has no material "wall"; there are )");
  test::expect_error(attempt(""), "has no mesh or material \"\"");
  test::expect_error(attempt("a\nb"), R"("a\nb")");
  for (const std::string box : {"box:", "box:1,2,3", "box:1,2,3,4,5,x", "box:1,2,3,4,5,6x",
                                "box:1,2,3,4,5,nan", "box:1;2;3;4;5;6", "box:1,2,3,4,5,"}) {
    test::expect_error(attempt(box), "is no box");
  }
  test::expect_error(attempt("box:10,10,10,11,11,11"), "nothing that is named has patches");
}

TEST(PatchSelection, WhatEmitsIsASource) {
  const Scene scene = named_scene();
  const PatchModel model = make_patch_model(scene, {.patch_count = 40});
  const PatchSelection wall(std::vector<std::string>{"wall"}, scene, "sources");
  const PatchRoles roles = choose_roles(model, {}, wall);
  for (std::size_t i = 0; i < roles.role.size(); ++i) {
    const float x = std::round(model.patches.centroid[i][0]);
    EXPECT_TRUE(roles.is_receiver(i));
    EXPECT_EQ(roles.is_source(i), x == 0 || x == 3) << x;
  }
  EXPECT_TRUE(choose_roles(model, {}, {}).all_are_both());
}

TEST(PatchSelection, MeshesAreKnownAfterTheirTrianglesAreCut) {
  const Scene scene = import_usable(kTwoRooms, 1);
  ASSERT_EQ(scene.triangle_mesh.size(), scene.triangle.size());
  ASSERT_EQ(scene.placed_meshes.size(), 8U);
  const PatchModel model = make_patch_model(scene, {.patch_count = 400});
  ASSERT_EQ(model.triangle_mesh.size(), model.mesh.triangle.size());
  const PatchSelection floor(std::vector<std::string>{"mesh:floor"}, scene, "receivers");
  const std::vector<std::uint8_t> selected = floor.patches(model);
  double area = 0;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    if (selected[i] == 0) continue;
    EXPECT_NEAR(model.patches.centroid[i][1], 0, 1e-3);
    EXPECT_GT(model.patches.normal[i][1], 0.99F);
    area += model.patches.area[i];
  }
  EXPECT_GT(area, 10);
}

TEST(WantedPart, CountsPairsThatWantLightBothWaysOnce) {
  constexpr std::uint8_t kNeither = 0, kReceiver = PatchRoles::kReceiver,
                         kSource = PatchRoles::kSource, kBoth = PatchRoles::kBoth;
  EXPECT_EQ(wanted_part({}, 4), 1);
  EXPECT_EQ(wanted_part({{kBoth, kBoth, kBoth, kBoth}}, 4), 1);
  EXPECT_NEAR(wanted_part({{kReceiver, kReceiver, kSource, kSource}}, 4), 0.5, 1e-12)
      << "from one half to the other";
  EXPECT_NEAR(wanted_part({{kBoth, kBoth, kSource, kSource}}, 4), 0.75, 1e-12);
  EXPECT_NEAR(wanted_part({{kBoth, kNeither, kNeither, kNeither}}, 4), 1.0 / 16, 1e-12);
}

}  // namespace
}  // namespace rebounce

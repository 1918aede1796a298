// Operators that no matrix of all pairs was made for, against the dense inverse.

#include "precompute/compression/matrix_free_transfer.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/compression/tolerance_search.h"
#include "precompute/inverse/hierarchical_matrix.h"
#include "precompute/inverse/solved_transfer.h"
#include "tests/support/exchange_samples.h"
#include "tests/support/expect_error.h"
#include "tests/support/solved_room.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/unshadowed_lights.h"
#include "transfer/base/area_norm.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce::test_matrix_free_transfer {
namespace {

using Lights = std::vector<std::vector<Float3>>;

Lights lights_in(const PatchTable& patches, int count, std::uint64_t seed) {
  return test::unshadowed_lights(patches, count, seed, 1.6, 1.2);
}

/// A room of 4 x 3 x 5 m with a black box. How near its form factors are to the truth does
/// not matter here.
struct Room {
  Room(const Float3& reflectance, std::size_t patch_count) {
    Scene scene = test::room_with_block(reflectance);
    scene.materials.push_back(scene.materials[0]);
    scene.materials[1].base_color = {0, 0, 0};
    test::add_box(scene, {2.5, 0, 3}, {3, 1, 4}, false, 1);
    const PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
    exchange =
        compute_form_factors(model, test::make_tracer(model), with_quality(FormFactorQuality::kLow))
            .exchange;
    patches = model.patches;
    training = lights_in(patches, 16, 1);
    validation = lights_in(patches, 12, 2);
    constexpr double kExactMultiplier = 1e-16;
    form_factors = std::make_shared<const HierarchicalOperator>(compress_matrix(
        FormFactorMatrix(exchange, patches.area), patches, training, kExactMultiplier));
  }

  PatchTable patches;
  ExchangeMatrix exchange;
  std::shared_ptr<const HierarchicalOperator> form_factors;  ///< exact, but for rounding
  Lights training, validation;

  FittingLights lights() const { return {training, validation}; }
};

/// With the dense inverse.
struct ColouredRoom : Room {
  ColouredRoom() : Room({0.7F, 0.5F, 0.2F}, 700) {
    dense = build_dense_transfer(exchange, patches, Precision::kF32);
  }

  std::shared_ptr<const DenseOperator> dense;
};

/// One matrix, and so the quicker.
struct GreyRoom : Room {
  explicit GreyRoom(std::size_t patch_count) : Room({0.6F, 0.6F, 0.6F}, patch_count) {}
};

const ColouredRoom& coloured_room() {
  static const ColouredRoom room;
  return room;
}

/// Of two cells.
const GreyRoom& small_room() {
  static const GreyRoom room(560);
  return room;
}

/// Of four.
const GreyRoom& large_room() {
  static const GreyRoom room(1060);
  return room;
}

constexpr HierarchicalSettings kCoarse{.tolerance = 0.02, .precision = Precision::kF32};

std::shared_ptr<const HierarchicalOperator> build(const Room& room,
                                                  const std::filesystem::path& checkpoint = {},
                                                  const Progress& progress = {}) {
  return build_matrix_free_transfer(*room.form_factors, room.patches, room.lights(),
                                    {.compression = kCoarse, .checkpoint = checkpoint}, progress);
}

/// Of the small room, without interruption.
const HierarchicalOperator& uninterrupted() {
  static const auto result = build(small_room());
  return *result;
}

void expect_same(const HierarchicalOperator& a, const HierarchicalOperator& b) {
  EXPECT_EQ(a.storage().blocks.size(), b.storage().blocks.size());
  EXPECT_TRUE(std::ranges::equal(a.storage().values_f32, b.storage().values_f32));
}

using Names = std::set<std::string>;

/// Before any file of this run was written.
const auto kLongAgo = std::filesystem::file_time_type::clock::now() - std::chrono::hours(24);

/// Dates all files of a folder back, so that one that is written again is known by its time.
void date_back(const std::filesystem::path& folder) {
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    std::filesystem::last_write_time(file.path(), kLongAgo);
  }
}

/// The files of a folder that nothing has written since they were dated back.
Names untouched_in(const std::filesystem::path& folder) {
  Names names;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    if (file.last_write_time() <= kLongAgo) names.insert(file.path().filename().string());
  }
  return names;
}

/// Builds the small room until that part is kept, and returns what is then there, dated back.
Names build_up_to(const std::filesystem::path& part) {
  EXPECT_THROW(build(small_room(), part.parent_path(),
                     [&](double) { return !std::filesystem::exists(part); }),
               Cancelled);
  EXPECT_TRUE(std::filesystem::exists(part));
  date_back(part.parent_path());
  return untouched_in(part.parent_path());
}

void flip_a_byte(const std::filesystem::path& path) {
  std::string bytes = test::read_bytes(path);
  bytes[bytes.size() / 2] ^= 1;
  test::write_bytes(path, bytes);
}

/// Of three runs of columns, relative to the dense inverse.
std::vector<double> column_errors(const SolvedTransfer& solved, const ColouredRoom& room) {
  SolvedTransfer::Workspace workspace;
  std::vector<double> errors;
  for (const std::size_t begin : {0U, 320U, 640U}) {
    const std::size_t count = std::min<std::size_t>(40, room.patches.size() - begin);
    SolvedTransfer::Vectors sent = SolvedTransfer::Vectors::Zero(solved.position_count(), count);
    sent.middleRows(begin, count).setIdentity();
    SolvedTransfer::Vectors columns = solved.later_bounces(1, sent, workspace);
    columns += workspace.first;
    double error = 0, norm = 0;
    for (std::size_t i = 0; i < room.patches.size(); ++i) {
      for (std::size_t j = 0; j < count; ++j) {
        const double exact =
            room.dense->symmetric_entry(1, solved.patch()[i], solved.patch()[begin + j]);
        error += std::pow(columns(i, j) - exact, 2);
        norm += exact * exact;
      }
    }
    errors.push_back(std::sqrt(error / norm));
  }
  return errors;
}

TEST(SolvedTransfer, ColumnsAreThoseOfTheDenseInverse) {
  const ColouredRoom& room = coloured_room();
  for (const double residual : {1e-2, 1e-3, 1e-5}) {
    const SolvedTransfer solved(*room.form_factors, room.patches, residual);
    ASSERT_EQ(solved.matrix_count(), 3U);
    // What is left of a residual r is G R (I - R G R)^-1 r, of about the size of r.
    for (const double error : column_errors(solved, room)) EXPECT_LT(error, 2 * residual);
  }
}

TEST(SolvedTransfer, ErrorsOfTheStepsAreThoseOfTheRestThatTheyFind) {
  const ColouredRoom& room = coloured_room();
  const HierarchicalMatrix form_factors(room.form_factors->storage());
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(room.patches.size(), 20);
  const Eigen::MatrixXf exact = form_factors.multiply(0, x);
  for (const double tolerance : {0.02, 0.1}) {
    const HierarchicalStorage coarse =
        compress_matrix(form_factors, room.patches, room.training,
                        initial_multiplier(tolerance, room.patches.size()));
    const double off = (HierarchicalMatrix(coarse).multiply(0, x) - exact).norm() / exact.norm();
    ASSERT_GT(off, tolerance / 2);
    const SolvedTransfer solved(*room.form_factors, coarse, room.patches, 1e-5);
    for (const double error : column_errors(solved, room)) {
      EXPECT_LT(error, off / 20);
      EXPECT_GT(error, 2e-5);
    }
    const Eigen::MatrixXf truth = DenseMatrix(*room.dense).multiply(1, x);
    EXPECT_LT((solved.multiply(1, x) - truth).norm(), off / 20 * truth.norm());
    const Eigen::MatrixXf even = x.cwiseAbs();
    const Eigen::MatrixXf of_even = DenseMatrix(*room.dense).multiply(1, even);
    EXPECT_LT((solved.multiply(1, even) - of_even).norm(), off / 20 * of_even.norm());
  }
}

TEST(SolvedTransfer, RefusesCoarseFormFactorsInAnotherOrder) {
  const ColouredRoom& room = coloured_room();
  const auto other = test::dense_blocks(room.exchange, room.patches.area);
  test::expect_error(
      [&] { SolvedTransfer(*room.form_factors, other->storage(), room.patches, 1e-3); },
      "another order");
}

TEST(SolvedTransfer, ProductsAreThoseOfTheDenseInverse) {
  const ColouredRoom& room = coloured_room();
  const SolvedTransfer solved(*room.form_factors, room.patches, 1e-6);
  const DenseMatrix dense(*room.dense);
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(room.patches.size(), 20);
  for (std::uint32_t m = 0; m < 3; ++m) {
    const Eigen::MatrixXf truth = dense.multiply(m, x);
    EXPECT_LT((solved.multiply(m, x) - truth).norm(), 1e-5F * truth.norm());
  }
}

TEST(SolvedTransfer, EstimatesEnergies) {
  const ColouredRoom& room = coloured_room();
  const SolvedTransfer solved(*room.form_factors, room.patches, 1e-4);
  const Eigen::VectorXd exact = DenseMatrix(*room.dense).energies(solved.patch());
  const Eigen::ArrayXd ratio = solved.estimated_energies().array() / exact.array();
  EXPECT_NEAR(ratio.mean(), 1, 0.03);
  // Each is off by sqrt(2 / 128), 0.125, or less; the farthest of 700 by four times that.
  EXPECT_LT(std::sqrt((ratio - 1).square().mean()), 0.15);
  EXPECT_GT(ratio.minCoeff(), 0.4);
}

TEST(SolvedTransfer, RefusesFormFactorsThatGainLight) {
  const Room& room = small_room();
  HierarchicalStorage doubled = room.form_factors->storage();
  std::vector<float> values(doubled.values_f32.begin(), doubled.values_f32.end());
  const HierarchicalLayout layout(doubled);
  for (std::size_t k = layout.basis_value_count; k < values.size(); ++k) values[k] *= 2;
  doubled.values_f32 = SharedArray(std::move(values));
  const HierarchicalOperator gaining(std::move(doubled));
  test::expect_error([&] { SolvedTransfer(gaining, room.patches, 1e-4); }, "do not converge");
}

TEST(MatrixFreeTransfer, KeepsTheToleranceAsCompressionOfTheDenseInverseDoes) {
  const ColouredRoom& room = coloured_room();
  const HierarchicalSettings settings{.tolerance = 0.005};
  const auto large = build_matrix_free_transfer(*room.form_factors, room.patches, room.lights(),
                                                {.compression = settings});
  const auto by_dense =
      build_hierarchical_transfer(*room.dense, room.patches, room.lights(), settings);
  const Lights others = lights_in(room.patches, 24, 3);
  EXPECT_LT(test::mean_error(*large, *room.dense, room.patches.area, others), settings.tolerance);
  EXPECT_LT(static_cast<double>(large->bytes()), 1.1 * static_cast<double>(by_dense->bytes()));
}

TEST(MatrixFreeTransfer, IsCompressedAgainFinerFromTheSameBases) {
  const GreyRoom& room = small_room();
  const MatrixFreeTransfer columns(*room.form_factors, room.patches, room.training,
                                   {.compression = kCoarse});
  expect_same(*columns.compress(room.lights(), kCoarse.tolerance), uninterrupted());
  const double tolerance = 0.6 * kCoarse.tolerance;
  const auto finer = columns.compress(room.lights(), tolerance);
  const auto dense = build_dense_transfer(room.exchange, room.patches, Precision::kF32);
  const auto error = [&](const HierarchicalOperator& compressed) {
    return test::mean_error(compressed, *dense, room.patches.area, lights_in(room.patches, 24, 3));
  };
  EXPECT_LT(error(*finer), 1.2 * tolerance) << "the columns are as exact as the coarse one needs";
  EXPECT_LT(error(*finer), error(uninterrupted()));
  EXPECT_GT(finer->bytes(), uninterrupted().bytes());
}

TEST(MatrixFreeTransfer, TakesAFewPatchesAndNoLights) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = 12});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  const HierarchicalOperator form_factors(
      compress_matrix(FormFactorMatrix(f.exchange, model.patches.area), model.patches, {}, 1e-16));
  const auto large = build_matrix_free_transfer(form_factors, model.patches, {}, {});
  const auto dense = build_dense_transfer(f.exchange, model.patches, Precision::kF32);
  const std::size_t n = model.patches.size();
  const std::vector<Float3> light(n, {1, 1, 1});
  std::vector<Float3> result(n), truth(n);
  std::vector<float> workspace(std::max(large->workspace_size(), dense->workspace_size()));
  large->apply(light, result, workspace);
  dense->apply(light, truth, workspace);
  EXPECT_LT(relative_difference(result, truth, model.patches.area), 0.005);
}

TEST(MatrixFreeTransfer, SameBitsForAnyNumberOfThreadsAndAnyMemory) {
  const Room& room = large_room();
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const auto one = build(room);
  omp_set_num_threads(6);
  const MatrixFreeTransferPlan free =
      plan_matrix_free_transfer({room.patches.size()}, {.compression = kCoarse});
  const MatrixFreeTransferPlan least = plan_matrix_free_transfer(
      {room.patches.size()}, {.compression = kCoarse, .memory_limit_bytes = 1});
  ASSERT_GT(room.patches.size(), 1024U) << "not four cells";
  ASSERT_EQ(free.cell_count, 24U);
  ASSERT_EQ(least.cell_count, 4U);
  const auto six = build(room);
  const auto limited =
      build_matrix_free_transfer(*room.form_factors, room.patches, room.lights(),
                                 {.compression = kCoarse, .memory_limit_bytes = least.peak_bytes});
  EXPECT_EQ(omp_get_max_threads(), 6) << "left behind";
  omp_set_num_threads(before);
  expect_same(*one, *six);
  expect_same(*one, *limited);
}

TEST(MatrixFreeTransfer, MoreThreadsForMoreMemory) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(16);
  for (const std::size_t matrices : {1U, 3U}) {
    const MatrixFreeTransferPlan free = plan_matrix_free_transfer({65536, matrices}),
                                 least = plan_matrix_free_transfer({65536, matrices},
                                                                   {.memory_limit_bytes = 1});
    EXPECT_EQ(free.thread_count, 16);
    EXPECT_GE(free.cell_count * matrices, 64U) << "not enough vectors for all threads";
    EXPECT_EQ(least.thread_count, 1);
    MatrixFreeTransferPlan last = least;
    int narrowed = 0;
    for (std::size_t limit = least.peak_bytes; limit < free.peak_bytes; limit += 100 << 20) {
      const MatrixFreeTransferPlan plan =
          plan_matrix_free_transfer({65536, matrices}, {.memory_limit_bytes = limit});
      EXPECT_LE(plan.peak_bytes, limit);
      EXPECT_GE(plan.thread_count, last.thread_count);
      narrowed += plan.thread_count > 1 ? 1 : 0;
      last = plan;
    }
    EXPECT_GT(narrowed, 3);
  }
  omp_set_num_threads(before);
}

TEST(MatrixFreeTransfer, GoesOnFromItsCouplingsWithTheSameBits) {
  const test::TemporaryFolder folder;
  const Names written = build_up_to(folder / "cell_0000");
  EXPECT_FALSE(written.contains("round_0_part_0000"));
  expect_same(*build(small_room(), folder.path()), uninterrupted());
  EXPECT_EQ(untouched_in(folder.path()), written) << "done again";
  // Now only the first is missing.
  std::filesystem::remove(folder / "cell_0000");
  expect_same(*build(small_room(), folder.path()), uninterrupted());
}

TEST(MatrixFreeTransfer, GoesOnFromItsRoundsWithTheSameBits) {
  const test::TemporaryFolder folder;
  for (const std::string part : {"round_0_part_0000", "round_1_part_0000"}) {
    const Names written = build_up_to(folder / part);
    EXPECT_TRUE(written.contains("cell_0001"));
    expect_same(*build(small_room(), folder.path()), uninterrupted());
    EXPECT_EQ(untouched_in(folder.path()), written) << "done again";
    std::filesystem::remove(folder / "round_1_part_0000");
  }
}

TEST(MatrixFreeTransfer, BeginsAnewWhereTheCheckpointIsOfSomethingElseOrDamaged) {
  const test::TemporaryFolder folder;
  GreyRoom darker = small_room();
  for (Float3& rho : darker.patches.reflectance) rho[0] = rho[1] = rho[2] = 0.5F * rho[0];
  build(darker, folder.path());
  expect_same(*build(small_room(), folder.path()), uninterrupted());

  // The same couplings, but another search.
  GreyRoom validated_otherwise = small_room();
  std::swap(validated_otherwise.validation.front(), validated_otherwise.validation.back());
  date_back(folder.path());
  build(validated_otherwise, folder.path());
  const Names kept = untouched_in(folder.path());
  EXPECT_TRUE(kept.contains("cell_0000"));
  EXPECT_FALSE(kept.contains("round_0_part_0000"));

  flip_a_byte(folder / "cell_0000");
  std::filesystem::resize_file(folder / "cell_0001", 200);
  flip_a_byte(folder / "round_0_part_0000");
  expect_same(*build(small_room(), folder.path()), uninterrupted());
}

TEST(MatrixFreeTransfer, StopsWhenAsked) {
  for (const double at : {0.0, 0.3, 0.45}) {  // the last one in the search
    double last = 0;
    EXPECT_THROW(build(small_room(), {},
                       [&](double done) {
                         EXPECT_GE(done, last);
                         last = done;
                         return done < at;
                       }),
                 Cancelled);
  }
}

TEST(MatrixFreeTransfer, RefusesWhatItCannotDo) {
  const Room& room = small_room();
  MatrixFreeTransferSettings settings{.compression = kCoarse, .memory_limit_bytes = 1};
  const std::size_t least = plan_matrix_free_transfer({room.patches.size()}, settings).peak_bytes;
  settings.memory_limit_bytes = least - 1;
  const auto attempt = [&] {
    build_matrix_free_transfer(*room.form_factors, room.patches, room.lights(), settings);
  };
  test::expect_error(attempt, "raise the memory limit");
  test::expect_error(attempt, std::to_string(least >> 20) + " MiB at the least");
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "file", "no folder");
  settings = {.compression = kCoarse, .checkpoint = folder / "file"};
  test::expect_error(attempt, "checkpoints");
}

TEST(MatrixFreeTransfer, TakesMemoryInProportionToThePatches) {
  const double at_64k = static_cast<double>(plan_matrix_free_transfer({65536, 3}).peak_bytes);
  EXPECT_NEAR(static_cast<double>(plan_matrix_free_transfer({131072, 3}).peak_bytes) / at_64k, 2,
              0.3);
  EXPECT_LT(plan_matrix_free_transfer({2000, 1}).peak_bytes,
            plan_matrix_free_transfer({4000, 1}).peak_bytes);
  EXPECT_LT(plan_matrix_free_transfer({4000, 1, 0.5}).peak_bytes,
            plan_matrix_free_transfer({4000, 1}).peak_bytes);
  // A finer operator takes more, one over a quarter of the patches less, but as many lights.
  PatchRoles quarter;
  for (std::size_t i = 0; i < 4000; ++i) quarter.role.push_back(i % 4 == 0 ? PatchRoles::kBoth : 0);
  const MatrixFreeTransferSettings fine{.compression = {.tolerance = 0.001}},
      part{.roles = quarter};
  const std::size_t usual = plan_matrix_free_transfer({4000, 3}).peak_bytes;
  EXPECT_GT(plan_matrix_free_transfer({4000, 3}, fine).peak_bytes, usual * 5 / 4);
  EXPECT_LT(plan_matrix_free_transfer({4000, 3}, part).peak_bytes, usual * 3 / 4);
  EXPECT_GT(plan_matrix_free_transfer({4000, 3}, part).peak_bytes, usual / 4);
}

TEST(MatrixFreeTransfer, TakesMoreMemoryForMoreCouplingsThanInRooms) {
  constexpr std::size_t kPatches = 65536;
  constexpr std::uint64_t kFew = 1'000'000, kMany = 4'000'000'000;
  const std::size_t usual = plan_matrix_free_transfer({kPatches, 3, 0, kFew}).peak_bytes;
  EXPECT_EQ(plan_matrix_free_transfer({kPatches, 3}).peak_bytes, usual);
  const MatrixFreeTransferPlan many = plan_matrix_free_transfer({kPatches, 3, 0, kMany});
  EXPECT_GT(many.peak_bytes, usual + kMany / 2);
  EXPECT_LT(many.peak_bytes, usual + 2 * kMany);
  const MatrixFreeTransferSettings limited{.memory_limit_bytes = usual};
  test::expect_error([&] { check_memory(kPatches, many, limited); }, "raise the memory limit");
  EXPECT_EQ(plan_matrix_free_transfer({kPatches, 3, 0, kMany}, limited).thread_count, 1);
}

}  // namespace
}  // namespace rebounce::test_matrix_free_transfer

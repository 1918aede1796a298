// Operators that no matrix of all pairs was made for, against the dense inverse.

#include "rebounce/precompute/large_transfer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "expect_error.h"
#include "matrix_compression.h"
#include "rebounce/precompute/dense_transfer.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/transfer/area_norm.h"
#include "single_threaded_blas.h"
#include "solved_transfer.h"
#include "temporary_folder.h"
#include "test_scenes.h"
#include "unshadowed_lights.h"
#include "with_threads.h"

namespace rebounce {
namespace {

using Lights = std::vector<std::vector<Float3>>;

Lights lights_in(const PatchTable& patches, int count, std::uint64_t seed) {
  return test::unshadowed_lights(patches, count, seed, 1.6, 1.2);
}

/// A room of 4 x 3 x 5 m with a black box.
struct Room {
  Room(const Float3& reflectance, std::size_t patch_count) {
    Scene scene = test::room_with_block(reflectance);
    scene.materials.push_back(scene.materials[0]);
    scene.materials[1].base_color = {0, 0, 0};
    test::add_box(scene, {2.5, 0, 3}, {3, 1, 4}, false, 1);
    PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
    const FormFactors f = compute_form_factors(model, test::make_tracer(model));
    patches = model.patches;
    dense = build_dense_transfer(f.exchange, patches, Precision::kF32);
    shaping = lights_in(patches, 16, 1);
    judging = lights_in(patches, 12, 2);
    form_factors = std::make_shared<const HierarchicalOperator>(
        compress_matrix(FormFactorMatrix(f.exchange, patches.area), patches, shaping, kExactPrice));
  }

  static constexpr double kExactPrice = 1e-16;

  PatchTable patches;
  std::shared_ptr<const DenseOperator> dense;
  std::shared_ptr<const HierarchicalOperator> form_factors;  ///< exact, but for rounding
  Lights shaping, judging;

  FittingLights lights() const { return {shaping, judging}; }
};

const Room& coloured_room() {
  static const Room room({0.7F, 0.5F, 0.2F}, 900);
  return room;
}

/// One matrix, and so the quicker.
const Room& grey_room() {
  static const Room room({0.6F, 0.6F, 0.6F}, 1200);
  return room;
}

constexpr HierarchicalSettings kCoarse{.tolerance = 0.02, .precision = Precision::kF32};

std::shared_ptr<const HierarchicalOperator> build(const Room& room,
                                                  const std::filesystem::path& checkpoint = {},
                                                  const Progress& progress = {}) {
  return build_large_transfer(*room.form_factors, room.patches, room.lights(),
                              {.compression = kCoarse, .checkpoint = checkpoint}, progress);
}

void expect_same(const HierarchicalOperator& a, const HierarchicalOperator& b) {
  EXPECT_EQ(a.storage().blocks.size(), b.storage().blocks.size());
  EXPECT_TRUE(std::ranges::equal(a.storage().values_f32, b.storage().values_f32));
}

std::size_t file_count(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

double mean_error(const Room& room, const TransferOperator& transfer, const Lights& lights) {
  double sum = 0;
  for (const auto& light : lights) {
    sum += relative_difference(product(transfer, light), product(*room.dense, light),
                               room.patches.area);
  }
  return sum / static_cast<double>(lights.size());
}

TEST(SolvedTransfer, ColumnsAreThoseOfTheDenseInverse) {
  const Room& room = coloured_room();
  const SingleThreadedBlas single_threaded;
  for (const double residual : {1e-2, 1e-3, 1e-5}) {
    const SolvedTransfer solved(*room.form_factors, room.patches, residual);
    ASSERT_EQ(solved.matrix_count(), 3U);
    for (const std::size_t begin : {0U, 320U, 832U}) {
      const std::size_t count = std::min<std::size_t>(40, room.patches.size() - begin);
      const auto patches = solved.patch().subspan(begin, count);
      const SolvedTransfer::Vectors columns = solved.columns(1, patches);
      double error = 0, norm = 0;
      for (std::size_t i = 0; i < room.patches.size(); ++i) {
        for (std::size_t j = 0; j < count; ++j) {
          const double exact = room.dense->symmetric_entry(1, solved.patch()[i], patches[j]);
          error += std::pow(columns(i, j) - exact, 2);
          norm += exact * exact;
        }
      }
      // What is left of a residual r is G R (I - R G R)^-1 r, of about the size of r.
      EXPECT_LT(std::sqrt(error / norm), 2 * residual);
    }
  }
}

TEST(SolvedTransfer, ProductsAreThoseOfTheDenseInverse) {
  const Room& room = coloured_room();
  const SolvedTransfer solved(*room.form_factors, room.patches, 1e-6);
  const DenseMatrix dense(*room.dense);
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(room.patches.size(), 20);
  for (std::uint32_t m = 0; m < 3; ++m) {
    const Eigen::MatrixXf truth = dense.multiply(m, x);
    EXPECT_LT((solved.multiply(m, x) - truth).norm(), 1e-5F * truth.norm());
  }
}

TEST(SolvedTransfer, EstimatesEnergies) {
  const Room& room = coloured_room();
  const SolvedTransfer solved(*room.form_factors, room.patches, 1e-4);
  const Eigen::VectorXd exact = DenseMatrix(*room.dense).energies(solved.patch());
  const Eigen::ArrayXd ratio = solved.estimated_energies().array() / exact.array();
  EXPECT_NEAR(ratio.mean(), 1, 0.03);
  // Each is off by sqrt(2 / 128), 0.125, or less; the farthest of 900 by four times that.
  EXPECT_LT(std::sqrt((ratio - 1).square().mean()), 0.15);
  EXPECT_GT(ratio.minCoeff(), 0.4);
}

TEST(SolvedTransfer, RefusesFormFactorsThatGainLight) {
  const Room& room = grey_room();
  HierarchicalOperator::Storage doubled = room.form_factors->storage();
  std::vector<float> values(doubled.values_f32.begin(), doubled.values_f32.end());
  const HierarchicalLayout layout(doubled);
  for (std::size_t k = layout.basis_value_count; k < values.size(); ++k) values[k] *= 2;
  doubled.values_f32 = SharedArray(std::move(values));
  const HierarchicalOperator gaining(std::move(doubled));
  test::expect_error([&] { SolvedTransfer(gaining, room.patches, 1e-4); }, "do not converge");
}

TEST(LargeTransfer, KeepsTheToleranceAsCompressionOfTheDenseInverseDoes) {
  const Room& room = coloured_room();
  const HierarchicalSettings settings{.tolerance = 0.005};
  const auto large = build_large_transfer(*room.form_factors, room.patches, room.lights(),
                                          {.compression = settings});
  const auto by_dense =
      build_hierarchical_transfer(*room.dense, room.patches, room.lights(), settings);
  const Lights others = lights_in(room.patches, 24, 3);
  EXPECT_LT(mean_error(room, *large, others), settings.tolerance);
  EXPECT_LT(static_cast<double>(large->bytes()), 1.1 * static_cast<double>(by_dense->bytes()));
}

TEST(LargeTransfer, TakesAFewPatchesAndNoLights) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = 12});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  const HierarchicalOperator form_factors(
      compress_matrix(FormFactorMatrix(f.exchange, model.patches.area), model.patches, {}, 1e-16));
  const auto large = build_large_transfer(form_factors, model.patches, {}, {});
  const auto dense = build_dense_transfer(f.exchange, model.patches, Precision::kF32);
  const std::vector<Float3> light(model.patches.size(), {1, 1, 1});
  EXPECT_LT(relative_difference(product(*large, light), product(*dense, light), model.patches.area),
            0.005);
}

TEST(LargeTransfer, SameBitsForAnyNumberOfThreads) {
  const Room& room = grey_room();
  const auto make = [&] { return build(room); };
  const auto one = test::with_threads(1, make), three = test::with_threads(3, make);
  expect_same(*one, *three);
}

TEST(LargeTransfer, GoesOnFromItsCheckpointWithTheSameBits) {
  const Room& room = grey_room();
  const test::TemporaryFolder folder;
  const auto panels = folder / "panels";
  EXPECT_THROW(
      build(room, panels,
            [&](double) { return !std::filesystem::exists(panels) || file_count(panels) < 2; }),
      Cancelled);
  ASSERT_EQ(file_count(panels), 2U);
  const auto written = std::filesystem::last_write_time(panels / "panel_0000");
  const auto resumed = build(room, panels);
  EXPECT_GT(file_count(panels), 2U);
  EXPECT_EQ(std::filesystem::last_write_time(panels / "panel_0000"), written) << "done again";
  expect_same(*resumed, *build(room));
}

TEST(LargeTransfer, BeginsAnewWhereTheCheckpointIsOfSomethingElseOrDamaged) {
  const Room& room = grey_room();
  const test::TemporaryFolder folder;
  Room darker = room;
  for (Float3& rho : darker.patches.reflectance) rho[0] = rho[1] = rho[2] = 0.5F * rho[0];
  build(darker, folder.path());
  const auto expected = build(room);
  expect_same(*build(room, folder.path()), *expected);

  // A byte of one file, and the end of another.
  std::fstream file(folder / "panel_0000", std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(5000);
  file.put('?');
  file.close();
  std::filesystem::resize_file(folder / "panel_0001", 200);
  expect_same(*build(room, folder.path()), *expected);
}

TEST(LargeTransfer, StopsWhenAsked) {
  const test::TemporaryFolder folder;
  for (const double at : {0.0, 0.3, 0.8}) {
    double last = 0;
    EXPECT_THROW(build(grey_room(), {},
                       [&](double done) {
                         EXPECT_GE(done, last);
                         last = done;
                         return done < at;
                       }),
                 Cancelled);
  }
}

TEST(LargeTransfer, RefusesWhatItCannotDo) {
  const Room& room = grey_room();
  LargeTransferSettings settings{.compression = kCoarse, .memory_limit_bytes = 1 << 20};
  const auto attempt = [&] {
    build_large_transfer(*room.form_factors, room.patches, room.lights(), settings);
  };
  test::expect_error(attempt, "raise the memory limit");
  const test::TemporaryFolder folder;
  std::ofstream(folder / "file") << "no folder";
  settings = {.compression = kCoarse, .checkpoint = folder / "file"};
  test::expect_error(attempt, "checkpoints");
}

TEST(LargeTransfer, TakesMemoryInProportionToThePatches) {
  const double at_64k = static_cast<double>(large_transfer_peak_bytes(65536, 3));
  EXPECT_NEAR(static_cast<double>(large_transfer_peak_bytes(131072, 3)) / at_64k, 2, 0.3);
  EXPECT_LT(large_transfer_peak_bytes(2000, 1), large_transfer_peak_bytes(4000, 1));
}

}  // namespace
}  // namespace rebounce

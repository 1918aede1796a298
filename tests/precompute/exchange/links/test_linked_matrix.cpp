// Entries and products of form factors that are there as links alone.

#include "precompute/exchange/links/linked_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "precompute/compression/form_factor_compression.h"
#include "precompute/exchange/links/links.h"
#include "tests/precompute/exchange/links/linked_patches.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scenes.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_linked_matrix {
namespace {

struct LinkedRoom {
  PatchModel model =
      make_patch_model(test::room_with_block({0.6F, 0.5F, 0.4F}), {.patch_count = 400});
  LinkBuild build = LinkBuilder(model, test::make_tracer(model), {}).build(kLinkEpsilon);

  const std::shared_ptr<const LinkedFormFactors>& links() const { return build.form_factors; }
  const PatchTable& patches() const { return model.patches; }
};

const LinkedRoom& room() {
  static const LinkedRoom instance;
  return instance;
}

/// A^1/2 F A^-1/2 by gathering of unit vectors.
Eigen::MatrixXf gathered() {
  const PatchTable& patches = room().patches();
  const std::size_t n = patches.size();
  Eigen::MatrixXf g(n, n);
  for (std::size_t j = 0; j < n; ++j) {
    std::vector<Float3> unit(n);
    unit[j][0] = 1 / std::sqrt(patches.area[j]);
    const std::vector<Float3> column = gather(*room().links(), unit);
    for (std::size_t i = 0; i < n; ++i) g(i, j) = column[i][0] * std::sqrt(patches.area[i]);
  }
  return g;
}

std::vector<std::uint32_t> some_patches(std::size_t begin, std::size_t count) {
  std::vector<std::uint32_t> all(room().patches().size());
  std::iota(all.begin(), all.end(), 0U);
  std::ranges::shuffle(all, std::mt19937(7));
  return {all.begin() + static_cast<std::ptrdiff_t>(begin),
          all.begin() + static_cast<std::ptrdiff_t>(begin + count)};
}

TEST(LinkedMatrix, EntriesAreThoseThatUnitVectorsGather) {
  ASSERT_LT(room().build.form_factors->link_count(),
            room().patches().size() * room().patches().size() / 4)
      << "links that stand for single pairs would test little";
  const Eigen::MatrixXf truth = gathered();
  const LinkedMatrix matrix(room().links(), room().patches());
  const std::array lists = {some_patches(0, 250), some_patches(250, 40), some_patches(300, 90)};
  for (const auto& [rows, columns] : {std::pair(lists[0], lists[1]), std::pair(lists[1], lists[2]),
                                      std::pair(lists[0], lists[0])}) {
    Eigen::MatrixXf entries(rows.size(), columns.size());
    matrix.entries(0, rows, columns, entries);
    float largest = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < columns.size(); ++j) {
        largest = std::max(largest, std::abs(entries(i, j) - truth(rows[i], columns[j])));
      }
    }
    EXPECT_LT(largest, 1e-5F * truth.cwiseAbs().maxCoeff()) << "single precision";
  }
}

TEST(LinkedMatrix, ProductsAreThoseOfItsEntries) {
  const Eigen::MatrixXf truth = gathered();
  const LinkedMatrix matrix(room().links(), room().patches());
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(truth.cols(), 7);
  EXPECT_LT((matrix.multiply(0, x) - truth * x).norm(), 1e-5F * (truth * x).norm());
}

TEST(LinkedMatrix, EnergiesAreThoseOfItsColumns) {
  const Eigen::MatrixXf truth = gathered();
  const LinkedMatrix matrix(room().links(), room().patches());
  const auto order = some_patches(0, room().patches().size());
  const Eigen::VectorXd energies = matrix.energies(order);
  const Eigen::VectorXd exact = truth.cast<double>().colwise().squaredNorm();
  EXPECT_LT((energies - exact).norm(), 1e-5 * exact.norm());
}

TEST(LinkedMatrix, IsZeroBetweenListsWithoutLinks) {
  const LinkedMatrix matrix(room().links(), room().patches());
  const std::size_t n = room().patches().size();
  int zero = 0, other = 0;
  for (std::size_t begin = 0; begin + 8 <= n; begin += 4) {
    const auto rows = some_patches(begin, 1), columns = some_patches(begin + 1, 1 + begin % 3);
    Eigen::MatrixXf entries(rows.size(), columns.size());
    matrix.entries(0, rows, columns, entries);
    // An affine entry may be 0 by chance, but not in this room.
    EXPECT_EQ(matrix.is_zero(rows, columns), (entries.array() == 0).all()) << begin;
    (matrix.is_zero(rows, columns) ? zero : other) += 1;
  }
  EXPECT_GT(zero, 3);
  EXPECT_GT(other, 3);
}

TEST(LinkedMatrix, IsCompressedToATolerance) {
  constexpr double kTolerance = 0.005;
  const std::size_t n = room().patches().size();
  std::mt19937 engine(3);
  std::vector<std::vector<Float3>> lights;
  for (int k = 0; k < 64; ++k) {
    // Smooth ones, as radiosities are.
    const double turn = engine() * 0x1p-32 * 6, slope = engine() * 0x1p-32;
    std::vector<Float3>& light = lights.emplace_back(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Float3& p = room().patches().centroid[i];
      const auto b = static_cast<float>(1 + std::sin(turn + slope * (p[0] + 2 * p[1] - p[2])));
      light[i] = {b, b, b};
    }
  }
  const auto unseen = lights.end() - 16;
  const auto compressed = compress_form_factors(
      room().links(), room().patches(), {},
      {{lights.begin(), lights.begin() + 32}, {lights.begin() + 32, unseen}}, {kTolerance});
  double error = 0;
  for (const auto& light : std::span(unseen, lights.end())) {
    error += relative_difference(product(*compressed, light), gather(*room().links(), light),
                                 room().patches().area) /
             16;
  }
  EXPECT_LT(error, kTolerance);
  EXPECT_GT(error, 0.05 * kTolerance) << "bytes are wasted";
}

TEST(LinkedMatrix, RefusesLinksOfOtherPatches) {
  PatchTable fewer = room().patches();
  fewer.area.pop_back();
  fewer.centroid.pop_back();
  test::expect_error([&] { LinkedMatrix(room().links(), fewer); }, "another number of patches");
}

}  // namespace
}  // namespace rebounce::test_linked_matrix

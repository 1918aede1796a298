// The operators of low rank against the dense one that they are made from.

#include "precompute/compression/low_rank_transfer.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>

#include "rebounce/error.h"
#include "tests/support/solved_room.h"
#include "tests/support/with_threads.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce::test_low_rank_transfer {
namespace {

struct Room : test::SolvedRoom {
  using SolvedRoom::SolvedRoom;
  std::shared_ptr<const HierarchicalOperator> low_rank(const LowRankSettings& settings) const {
    return build_low_rank_transfer(*dense, settings);
  }
};

Room make_room(std::size_t patch_count, const Float3& reflectance) {
  Scene scene = test::empty_scene(reflectance);
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true, 0);
  test::add_box(scene, {1, 0, 1}, {2, 1.2, 2.5}, false, 0);
  return {scene, patch_count};
}

const Room& small_room() {
  static const Room room = make_room(400, {0.7F, 0.5F, 0.2F});
  return room;
}

const Room& grey_room() {
  static const Room room = make_room(760, {0.6F, 0.6F, 0.6F});
  return room;
}

/// Yhat of one channel, [n][n].
Eigen::MatrixXd symmetric(const TransferOperator& transfer, const PatchTable& patches,
                          int channel) {
  const std::size_t n = patches.size();
  std::vector<float> y(n * n);
  transfer.expand(channel, y);
  Eigen::MatrixXd result(n, n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      result(i, j) = y[i * n + j] * std::sqrt(patches.area[i] / patches.area[j]);
    }
  }
  return result;
}

/// Frobenius norm of what the best approximation of this rank misses (Eckart and Young).
double least_error(const Eigen::MatrixXd& symmetric, int rank) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric, Eigen::EigenvaluesOnly);
  std::vector<double> squares;
  for (const double e : solver.eigenvalues()) squares.push_back(e * e);
  std::ranges::sort(squares, std::greater<>());
  double sum = 0;
  for (std::size_t k = rank; k < squares.size(); ++k) sum += squares[k];
  return std::sqrt(sum);
}

std::vector<Float3> smooth_light(const PatchTable& patches) {
  std::vector<Float3> light;
  for (const Float3& p : patches.centroid) light.push_back({p[0] + 1, p[1] + 1, p[2] + 1});
  return light;
}

TEST(LowRankTransfer, AFullRankIsExact) {
  const Room& room = small_room();
  const auto transfer = room.low_rank({100000, Precision::kF32});
  EXPECT_EQ(transfer->storage().blocks.front().row_rank, room.patches.size());
  const std::vector<Float3> light = smooth_light(room.patches);
  EXPECT_LT(relative_difference(product(*transfer, light), product(*room.dense, light),
                                room.patches.area),
            1e-5);
}

TEST(LowRankTransfer, NoOtherOfItsRankIsNearer) {
  // A grey room has one matrix, for which the optimum is known; 760 patches take the sketch.
  const Room& room = grey_room();
  const Eigen::MatrixXd y = symmetric(*room.dense, room.patches, 0);
  const auto transfer = room.low_rank({64, Precision::kF32});
  const double error = (symmetric(*transfer, room.patches, 0) - y).norm();
  const double least = least_error(y, 64);
  // Subspace iteration tells eigenvalues that are nearly equal apart slowly.
  EXPECT_LT(error, 1.05 * least + 1e-5 * y.norm());
  EXPECT_GT(error, 0.99 * least);
}

TEST(LowRankTransfer, IsSymmetric) {
  const Room& room = small_room();
  const auto transfer = room.low_rank({20, Precision::kF16});
  for (int c = 0; c < kChannelCount; ++c) {
    const Eigen::MatrixXd y = symmetric(*transfer, room.patches, c);
    EXPECT_LT((y - y.transpose()).norm(), 1e-5 * y.norm());
  }
}

TEST(LowRankTransfer, MoreRanksAreMoreExactAndMoreBytes) {
  const Room& room = small_room();
  const std::vector<Float3> light = smooth_light(room.patches);
  const std::vector<Float3> truth = product(*room.dense, light);
  double before = 1;
  for (const std::size_t rank : {4, 16, 64}) {
    const auto transfer = room.low_rank({rank, Precision::kF16});
    EXPECT_EQ(transfer->kind(), OperatorKind::kLowRank);
    EXPECT_LT(transfer->bytes(), room.low_rank({rank, Precision::kF32})->bytes());
    const double error = relative_difference(product(*transfer, light), truth, room.patches.area);
    EXPECT_LT(error, before);
    before = error;
  }
}

TEST(LowRankTransfer, SameBitsForAnyNumberOfThreads) {
  const Room& room = grey_room();
  const std::vector<Float3> light = smooth_light(room.patches);
  const auto make = [&] { return product(*room.low_rank({32, Precision::kF16}), light); };
  EXPECT_EQ(test::with_threads(1, make), test::with_threads(3, make));
}

TEST(LowRankTransfer, StopsWhenAsked) {
  const Room& room = grey_room();
  EXPECT_THROW(build_low_rank_transfer(*room.dense, {}, [](double) { return false; }), Cancelled);
}

}  // namespace
}  // namespace rebounce::test_low_rank_transfer

// The weights of lights that errors are taken with.

#include "precompute/compression/light_weights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace rebounce::test_light_weights {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

class KnownMatrix final : public SymmetricMatrix {
 public:
  explicit KnownMatrix(MatrixXf entries)
      : entries_(std::move(entries)), area_(entries_.rows(), 1) {}

  std::span<const float> area() const override { return area_; }
  void entries(std::uint32_t /*matrix*/, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<MatrixXf> entries) const override {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < columns.size(); ++j) {
        entries(static_cast<Index>(i), static_cast<Index>(j)) = entries_(rows[i], columns[j]);
      }
    }
  }
  MatrixXf multiply(std::uint32_t /*matrix*/, const MatrixXf& x) const override {
    return entries_ * x;
  }

 private:
  MatrixXf entries_;
  std::vector<float> area_;
};

/// One cluster of as many patches, the last one first.
ClusterTree reversed_cluster(std::uint32_t patch_count) {
  ClusterTree tree;
  tree.patch.resize(patch_count);
  std::iota(tree.patch.rbegin(), tree.patch.rend(), 0U);
  tree.clusters.push_back(
      {0, static_cast<std::uint32_t>(HierarchicalFormat::position_count(patch_count))});
  return tree;
}

MatrixXd random_matrix(Index rows, Index columns) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(engine); });
}

TEST(BackgroundLight, GrowsWhereThePatchesLightHardlyArrives) {
  // Patches that exchange light with themselves alone; more than are looked at together.
  constexpr std::uint32_t kPatches = 300;
  VectorXd gain = VectorXd::Constant(kPatches, 0.5);
  gain[3] = 0.05;
  gain[7] = 5;
  gain[11] = 0;
  const KnownMatrix matrix(MatrixXf(gain.cast<float>().asDiagonal()));
  const VectorXd background = background_light(matrix, reversed_cluster(kPatches));
  ASSERT_EQ(background.size(), 304);
  const auto of_patch = [&](Index patch) { return background[kPatches - 1 - patch]; };
  EXPECT_NEAR(of_patch(0), 1, 1e-6);
  EXPECT_NEAR(of_patch(7), 1, 1e-6);
  EXPECT_NEAR(background[303], 1, 1e-6);
  EXPECT_NEAR(of_patch(3), 10, 1e-5);  // as much as its light lacks
  EXPECT_GT(of_patch(11), of_patch(3));
  EXPECT_LE(of_patch(11), 1e3);  // or single precision could not hold the bases
}

TEST(BackgroundLight, IsOneWhereNoLightArrivesAnywhere) {
  const VectorXd background =
      background_light(KnownMatrix(MatrixXf::Zero(20, 20)), reversed_cluster(20));
  EXPECT_EQ(background, VectorXd::Ones(32));
}

/// The weight of one cluster of 32 positions under four lights.
struct Weighted {
  VectorXd background = VectorXd::LinSpaced(32, 1, 4);
  MatrixXd lights = random_matrix(32, 4);
  ClusterWeight weight =
      make_cluster_weights(reversed_cluster(32).clusters, lights, background).front();

  MatrixXd matrix() const {
    MatrixXd w = MatrixXd::Identity(32, 32);
    weight.weigh_columns(w);
    return w;
  }
};

TEST(ClusterWeights, AddTheLightsToTheBackground) {
  const Weighted weighted;
  const MatrixXd w = weighted.matrix();
  const MatrixXd covariance = w * w.transpose();
  const MatrixXd of_lights = weighted.lights * weighted.lights.transpose();
  const MatrixXd of_background = weighted.background.cwiseAbs2().asDiagonal();
  // In units of the background's variance: any entry off the diagonal tells it.
  const double variance = of_lights(1, 0) / covariance(1, 0);
  EXPECT_GT(variance, 0);
  EXPECT_LE((covariance - of_background - of_lights / variance).norm(), 1e-9 * covariance.norm());
}

TEST(ClusterWeights, ArePutOnEitherSideAndTakenAway) {
  const Weighted weighted;
  const MatrixXd before = random_matrix(32, 5);
  MatrixXd left = before;
  weighted.weight.weigh_rows(left);
  EXPECT_LE((left - weighted.matrix().transpose() * before).norm(), 1e-9 * left.norm());
  weighted.weight.unweigh_rows(left);
  EXPECT_LE((left - before).norm(), 1e-9 * before.norm());
}

}  // namespace
}  // namespace rebounce::test_light_weights

#include "precompute/compression/light_directions.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <array>
#include <cmath>

#include "precompute/base/random_signs.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

constexpr Index kPatches = 40, kDark = 12, kSamples = 96;

/// Light that decays from one direction to the next; the last patches have none.
MatrixXf samples(std::uint64_t seed) {
  const Eigen::HouseholderQR<MatrixXf> qr(random_signs(kPatches - kDark, kPatches - kDark, 1));
  MatrixXf strength = random_signs(kPatches - kDark, kSamples, seed);
  for (Index k = 0; k < strength.rows(); ++k) {
    strength.row(k) *= std::exp2(-0.5F * static_cast<float>(k));
  }
  MatrixXf light = MatrixXf::Zero(kPatches, kSamples);
  light.topRows(kPatches - kDark) = qr.householderQ() * strength;
  return light;
}

MatrixXd orthonormal(Index columns) {
  MatrixXd some = random_signs(kPatches, columns, 2).cast<double>();
  const Eigen::HouseholderQR<MatrixXd> qr(some);
  return qr.householderQ() * MatrixXd::Identity(kPatches, columns);
}

TEST(LightDirections, AreOrthonormalAndTellWhatIsMissing) {
  const MatrixXf judges = samples(4);
  for (const Index kept : {Index{0}, Index{5}, kPatches - kDark, kPatches}) {
    SCOPED_TRACE(kept);
    const LightDirections found = find_light_directions(samples(3), judges, orthonormal(kept));
    const MatrixXd& v = found.vectors;
    ASSERT_EQ(v.cols(), kPatches);
    EXPECT_EQ(found.kept, kept);
    EXPECT_EQ(v.leftCols(kept), orthonormal(kept));
    EXPECT_LT((v.transpose() * v - MatrixXd::Identity(kPatches, kPatches)).norm(), 1e-12);
    for (Index k = 0; k <= kPatches; ++k) {
      const MatrixXd light = judges.cast<double>();
      const MatrixXd left = light - v.leftCols(k) * (v.leftCols(k).transpose() * light);
      EXPECT_NEAR(found.missing[k], left.squaredNorm() / kSamples, 1e-9);
    }
  }
}

TEST(LightDirections, ThoseWithTheMostEnergyComeFirst) {
  const LightDirections found = find_light_directions(samples(3), samples(4), orthonormal(0));
  for (Index k = 1; k < kPatches - kDark; k += 3) {
    // Energies fall by a half from one direction to the next.
    EXPECT_NEAR(std::log2(found.missing[k - 1] / found.missing[k]), 1, 0.6) << k;
  }
}

TEST(LightDirections, RanksMissAtMostWhatIsAllowed) {
  const std::array cells{find_light_directions(samples(3), samples(4), orthonormal(0)),
                         find_light_directions(samples(5), samples(6), orthonormal(3))};
  Index before = 2 * kPatches + 1;
  for (const double allowed : {0.0, 1e-3, 0.05, 1.0, 100.0}) {
    const std::vector<Index> ranks = ranks_within(cells, allowed);
    EXPECT_LE(cells[0].missing[ranks[0]] + cells[1].missing[ranks[1]], allowed + 1e-12);
    EXPECT_GE(ranks[1], 3) << "what is kept";
    EXPECT_LT(ranks[0] + ranks[1], before) << "more than with less allowed";
    before = ranks[0] + ranks[1];
  }
  EXPECT_EQ(before, 3);
}

}  // namespace
}  // namespace rebounce

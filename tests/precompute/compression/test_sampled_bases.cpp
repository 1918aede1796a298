// Bases of the light of later bounces, found from random samples, against the dense inverse.

#include "precompute/compression/sampled_bases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "precompute/compression/coupling_solver.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/inverse/solved_matrix.h"
#include "tests/support/exchange_samples.h"
#include "tests/support/solved_room.h"
#include "tests/support/unshadowed_lights.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_sampled_bases {
namespace {

using Lights = std::vector<std::vector<Float3>>;

/// A room of 4 x 3 x 5 m with a block, of three channels.
struct Room : test::SolvedRoom {
  Room() : SolvedRoom(test::room_with_block({0.8F, 0.6F, 0.3F}), 1300) {}

  std::shared_ptr<const HierarchicalOperator> form_factors =
      test::dense_blocks(exchange, patches.area);
  SolvedTransfer solved{*form_factors, patches, 1e-5};
  Lights training = test::unshadowed_lights(patches, 24, 1, 1.6, 1.2);
};

const Room& room() {
  static const Room made;
  return made;
}

/// The bases of the room at a tolerance, and the matrix in them.
struct Sampled {
  explicit Sampled(double tolerance, const PatchRoles& roles = {})
      : matrix(room().solved, room().solved.estimated_energies(roles), roles),
        frame(compression_frame(matrix, room().patches, room().training)),
        cells(clusters_up_to(frame.tree, kBasisCell)),
        bases(sample_bases(room().solved, frame, cells, tolerance)) {}

  void solve() {
    const BlockCheckpoint none;
    CouplingSolver solver(room().solved, bases, {frame, cells}, 2, none);
    matrix.set_entries(bases, solver.run({}));
  }

  Eigen::Index rank() const {
    Eigen::Index sum = 0;
    for (std::size_t m = 0; m < bases.bases.size(); ++m) {
      sum += bases.ranks_between(m, 0, bases.cell_count());
    }
    return sum;
  }

  SolvedMatrix matrix;
  CompressionFrame frame;
  std::vector<std::uint32_t> cells;
  SharedBases bases;
};

/// All entries of a channel, [n][n].
Eigen::MatrixXf entries_of(const SymmetricMatrix& matrix, std::uint32_t channel) {
  std::vector<std::uint32_t> all(matrix.area().size());
  std::iota(all.begin(), all.end(), 0U);
  Eigen::MatrixXf entries(all.size(), all.size());
  matrix.entries(channel, all, all, entries);
  return entries;
}

/// The root mean square over lights of the frame of the relative error of indirect light.
double error_of(const Sampled& sampled) {
  const DenseMatrix dense(*room().dense);
  const auto n = static_cast<Eigen::Index>(room().patches.size());
  Eigen::MatrixXf lights(n, sampled.frame.sample.cols() - 1);  // the uniform light is stronger
  for (Eigen::Index k = 0; k < n; ++k) {
    lights.row(sampled.frame.tree.patch[k]) =
        sampled.frame.sample.row(k).rightCols(lights.cols()).cast<float>();
  }
  double squares = 0;
  for (std::uint32_t m = 0; m < 3; ++m) {
    squares += ((entries_of(sampled.matrix, m) - entries_of(dense, m)) * lights).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(lights.cols()));
}

TEST(SampledBases, LightErrsByTheToleranceOfTheBases) {
  Eigen::Index before = 3 * static_cast<Eigen::Index>(room().patches.size());
  for (const double tolerance : {0.0005, 0.003, 0.02}) {
    SCOPED_TRACE(tolerance);
    Sampled sampled(tolerance);
    sampled.solve();
    const double error = error_of(sampled);
    RecordProperty("error of " + std::to_string(tolerance), std::to_string(error));
    // The tolerance is of lights and as much of a background that these lights lack.
    EXPECT_LT(error, 1.3 * tolerance);
    EXPECT_GT(error, 0.15 * tolerance);
    EXPECT_LT(sampled.rank(), before) << "a coarser basis is no smaller";
    before = sampled.rank();
  }
}

TEST(SampledBases, EntriesAreSymmetricAndThoseOfFormFactorsAreExact) {
  Sampled sampled(0.001);
  sampled.solve();
  const Eigen::MatrixXf all = entries_of(sampled.matrix, 0);
  EXPECT_LT((all - all.transpose()).norm(), 1e-4F * all.norm());
  const Eigen::MatrixXf exact = entries_of(DenseMatrix(*room().dense), 0);
  const Eigen::MatrixXf first = entries_of(room().solved.form_factors(), 0);
  EXPECT_LT((all - exact).norm(), 0.1F * (first - exact).norm());
}

TEST(SampledBases, LightsAndVectorsOfACellAreDual) {
  const Sampled sampled(0.003);
  for (const std::vector<SharedBases::Basis>& cells : sampled.bases.bases) {
    for (const SharedBases::Basis& basis : cells) {
      const Eigen::MatrixXf product = basis.lights.transpose() * basis.vectors;
      EXPECT_TRUE(product.isIdentity(1e-4F));
    }
  }
}

TEST(SampledBases, HaveTheSameBitsForAnyNumberOfThreads) {
  const auto at = [](int threads) {
    return test::with_threads(threads, [] { return Sampled(0.01).bases; });
  };
  const SharedBases one = at(1), five = at(5);
  for (std::size_t m = 0; m < one.bases.size(); ++m) {
    for (std::size_t c = 0; c < one.cell_count(); ++c) {
      ASSERT_EQ(one.rank(m, c), five.rank(m, c));
      EXPECT_EQ(one.bases[m][c].lights, five.bases[m][c].lights);
      EXPECT_EQ(one.bases[m][c].vectors, five.bases[m][c].vectors);
    }
  }
}

TEST(SampledBases, CellsWithoutARoleHaveNone) {
  PatchRoles roles;
  for (const Float3& p : room().patches.centroid) {
    roles.role.push_back(p[2] < 1.5F ? PatchRoles::kBoth : 0);
  }
  const Sampled some(0.01, roles), all(0.01);
  EXPECT_LT(some.rank(), all.rank());
  std::size_t empty = 0;
  for (std::size_t c = 0; c < some.cells.size(); ++c) {
    const bool has_role = std::ranges::any_of(some.bases.patches[c],
                                              [&](std::uint32_t p) { return roles.role[p] != 0; });
    if (has_role) continue;
    EXPECT_EQ(some.bases.rank(0, c), 0);
    ++empty;
  }
  EXPECT_GT(empty, 0U);
}

TEST(ClusterTree, ClustersUpToASizeCoverAllPositionsInOrder) {
  const ClusterTree tree = build_cluster_tree(room().patches, 32);
  for (const std::uint32_t most : {1U, 32U, 100U, 5000U}) {
    std::uint32_t next = 0;
    for (const std::uint32_t index : clusters_up_to(tree, most)) {
      const Cluster& cluster = tree.clusters[index];
      EXPECT_TRUE(cluster.count <= most || cluster.is_leaf());
      EXPECT_EQ(cluster.begin, next);
      next = cluster.begin + cluster.count;
    }
    EXPECT_EQ(next, tree.clusters.front().count);
  }
  EXPECT_EQ(clusters_up_to(tree, 5000).size(), 1U);
}

}  // namespace
}  // namespace rebounce::test_sampled_bases

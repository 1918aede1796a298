// Bases of the light of later bounces, found from random samples, against the dense inverse.

#include "precompute/compression/sampled_bases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "precompute/compression/coupling_solver.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/inverse/patch_groups.h"
#include "precompute/inverse/solved_matrix.h"
#include "tests/support/exchange_samples.h"
#include "tests/support/solved_room.h"
#include "tests/support/unshadowed_lights.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_sampled_bases {
namespace {

using Lights = std::vector<std::vector<Float3>>;

struct Room : test::SolvedRoom {
  Room(const Scene& scene, std::size_t patch_count) : SolvedRoom(scene, patch_count) {}

  std::shared_ptr<const HierarchicalOperator> form_factors =
      test::dense_blocks(exchange, patches.area);
  SolvedTransfer solved{*form_factors, patches, 1e-5};
  Lights training = test::unshadowed_lights(patches, 24, 1, 1.6, 1.2);
};

/// A room of 4 x 3 x 5 m with a block, of three channels.
const Room& room() {
  static const Room made(test::room_with_block({0.8F, 0.6F, 0.3F}), 1300);
  return made;
}

/// Two rooms of 4 x 2.6 x 4 m, with a gap at the end of the wall between them or none. Patches of
/// a slab under the house have no light.
const Room& two_rooms(bool with_gap) {
  const auto make = [](double end) {
    Scene scene = test::empty_scene({0.8F, 0.6F, 0.3F});
    test::add_box(scene, {0, 0, 0}, {8.2, 2.6, 4}, true);
    test::add_box(scene, {4, 0, 0}, {4.2, 2.6, end}, false);
    test::add_box(scene, {-0.1, -0.2, -0.1}, {8.3, -0.1, 4.1}, false);
    return Room(scene, 1800);
  };
  static const Room open = make(3.2), closed = make(4);
  return with_gap ? open : closed;
}

/// The bases of a room at a tolerance, and the matrix in them.
struct Sampled {
  explicit Sampled(double tolerance, const PatchRoles& with = {}, const Room& of_room = room(),
                   std::uint32_t cell_size = kBasisCell)
      : of(of_room),
        matrix(of.solved, of.solved.estimated_energies(with), with,
               group_patches(of.solved.form_factors())),
        frame(compression_frame(matrix, of.patches, of.training)),
        cells(clusters_up_to(frame.tree, cell_size)),
        bases(sample_bases(of.solved, frame, cells, tolerance)) {}

  /// Returns the number of solves.
  std::size_t solve() {
    const BlockCheckpoint none;
    CouplingSolver solver(of.solved, bases, {frame, cells}, 2, none);
    const std::size_t count = solver.solve_count();
    matrix.set_entries(bases, solver.run({}));
    return count;
  }

  Eigen::Index rank() const {
    Eigen::Index sum = 0;
    for (std::size_t m = 0; m < bases.bases.size(); ++m) {
      for (std::size_t c = 0; c < bases.cell_count(); ++c) sum += bases.rank(m, c);
    }
    return sum;
  }

  const Room& of;
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
  const DenseMatrix dense(*sampled.of.dense);
  const auto n = static_cast<Eigen::Index>(sampled.of.patches.size());
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

constexpr std::uint32_t kSmallCell = 64;

/// The number of patches in the cells of each group that are in each of the two rooms.
std::array<std::array<int, 2>, 2> patches_in_rooms(const Sampled& sampled) {
  std::array<std::array<int, 2>, 2> count{};
  for (std::size_t c = 0; c < sampled.bases.cell_count(); ++c) {
    for (const std::uint32_t p : sampled.bases.patches[c]) {
      const Float3& at = sampled.of.patches.centroid[p];
      const bool is_inside = at[1] >= 0 && at[1] <= 2.6F && at[2] >= 0 && at[2] <= 4;
      if (is_inside && at[0] >= 0 && at[0] <= 8.2F) ++count[sampled.bases.group[c]][at[0] > 4.1F];
    }
  }
  return count;
}

TEST(SampledBases, RoomsBehindADoorAreGroups) {
  for (const double tolerance : {0.0005, 0.003, 0.02}) {
    SCOPED_TRACE(tolerance);
    Sampled sampled(tolerance, {}, two_rooms(true), kSmallCell);
    const SharedBases& bases = sampled.bases;
    for (const auto& [low, high] : patches_in_rooms(sampled)) {
      EXPECT_GT(low + high, 500);
      EXPECT_LT(std::min(low, high), 16) << "more than the alignment of clusters";
    }
    std::size_t couplings = 0;
    Eigen::Index far = 0;
    for (std::size_t c = 0; c < bases.cell_count(); ++c) {
      couplings += bases.coupling_count(c);
      for (std::size_t m = 0; m < bases.bases.size(); ++m) {
        EXPECT_LE(bases.bases[m][c].far_rank, bases.rank(m, c));
        far += bases.bases[m][c].far_rank;
      }
    }
    EXPECT_GT(far, 0);
    EXPECT_LT(far, sampled.rank() / 2);
    const auto rank = static_cast<std::size_t>(sampled.rank());
    EXPECT_LT(couplings, rank * rank / 3 * 4 / 10) << "as many as of one group";
    EXPECT_LT(sampled.solve(), rank * 8 / 10) << "as many as there are vectors";
    const double error = error_of(sampled);
    RecordProperty("error of " + std::to_string(tolerance), std::to_string(error));
    EXPECT_LT(error, 1.3 * tolerance);
  }
}

TEST(SampledBases, RoomsWithoutADoorShareNearlyNothing) {
  Sampled sampled(0.003, {}, two_rooms(false), kSmallCell);
  EXPECT_EQ(std::ranges::max(sampled.bases.group), 1U);
  Eigen::Index far = 0;  // of cells that have a few patches of the other room, by alignment
  for (const std::vector<SharedBases::Basis>& cells : sampled.bases.bases) {
    for (const SharedBases::Basis& basis : cells) far += basis.far_rank;
  }
  EXPECT_LT(far, sampled.rank() / 10);
  sampled.solve();
  const double error = error_of(sampled);
  RecordProperty("error", std::to_string(error));
  EXPECT_LT(error, 1.3 * 0.003);
}

/// The patches of the cells of each group.
std::vector<std::vector<std::uint32_t>> patches_of_groups(const SharedBases& bases) {
  std::vector<std::vector<std::uint32_t>> patches(1 + std::ranges::max(bases.group));
  for (std::size_t c = 0; c < bases.cell_count(); ++c) {
    std::vector<std::uint32_t>& own = patches[bases.group[c]];
    own.insert(own.end(), bases.patches[c].begin(), bases.patches[c].end());
  }
  return patches;
}

/// The greatest error of the parts of a matrix between two lists, as a fraction of its norm there;
/// nothing where there are none.
std::optional<float> error_of_parts(const SymmetricMatrix& matrix,
                                    std::span<const std::uint32_t> rows,
                                    std::span<const std::uint32_t> columns) {
  const std::optional<JointEntryParts> parts = matrix.parts(rows, columns);
  if (!parts) return std::nullopt;
  float greatest = 0;
  for (std::uint32_t m = 0; m < matrix.matrix_count(); ++m) {
    Eigen::MatrixXf entries(rows.size(), columns.size());
    matrix.entries(m, rows, columns, entries);
    RowVectors sum = RowVectors::Zero(entries.rows(), entries.cols());
    const RowVectors all = RowVectors::Identity(entries.cols(), entries.cols());
    add_product(parts->common, all, sum);
    add_product(parts->own[m], all, sum);
    greatest = std::max(greatest, (sum - entries).norm() / entries.norm());
  }
  return greatest;
}

TEST(SampledBases, PartsAddUpToTheEntries) {
  Sampled sampled(0.02, {}, two_rooms(true), kSmallCell);
  sampled.solve();
  const auto groups = patches_of_groups(sampled.bases);
  std::size_t found = 0, left = 0;
  // Neighbours along the order of patches.
  for (std::size_t begin = 0; begin + 320 <= groups[0].size(); begin += 80) {
    const auto rows = std::span(groups[0]).subspan(begin, 320);
    for (const std::size_t of : {0, 1}) {
      for (std::size_t other = 0; other + 256 <= groups[of].size(); other += 64) {
        if (of == 0 && other + 256 > begin && begin + 320 > other) continue;
        const auto columns = std::span(groups[of]).subspan(other, 256);
        const auto error = error_of_parts(sampled.matrix, rows, columns);
        const auto mirrored = error_of_parts(sampled.matrix, columns, rows);
        EXPECT_LE(error.value_or(0), 1e-4F);
        EXPECT_LE(mirrored.value_or(0), 1e-4F);
        (error ? found : left) += 1;
      }
    }
    EXPECT_LE(error_of_parts(sampled.matrix, rows, rows).value_or(0), 1e-4F);
  }
  EXPECT_GT(found, 5U);
  EXPECT_GT(left, 5U);
}

TEST(SampledBases, EveryDirectionIsFarWhereNothingMayBeLost) {
  Sampled sampled(1e-7, {}, two_rooms(true), kSmallCell);
  std::size_t full = 0;
  for (const std::vector<SharedBases::Basis>& cells : sampled.bases.bases) {
    for (const SharedBases::Basis& basis : cells) full += basis.far_rank == basis.vectors.rows();
  }
  EXPECT_GT(full, 0U);
  sampled.solve();
  EXPECT_LT(error_of(sampled), 1e-4) << "the solves are in single precision";
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

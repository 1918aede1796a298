// Cluster coefficients for the positions of large blocks, on a kernel over the walls of a box.

#include "precompute/compression/nested_bases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "precompute/compression/block_tree.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/compression/tolerance_search.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test_nested_bases {
namespace {

using Storage = HierarchicalStorage;

/// The walls of a box, of as many patches along its edges.
PatchTable box_of(int side) {
  PatchTable patches;
  const float step = 1 / static_cast<float>(side);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float wall : {0.0F, 1.0F}) {
      for (int k = 0; k < side * side; ++k) {
        const int row = k / side, column = k % side;
        Float3 at, normal{};
        at[axis] = wall;
        at[(axis + 1) % 3] = step * (static_cast<float>(column) + 0.5F);
        at[(axis + 2) % 3] = step * (static_cast<float>(row) + 0.5F);
        normal[axis] = wall == 0 ? 1 : -1;
        patches.area.push_back(step * step);
        patches.centroid.push_back(at);
        patches.normal.push_back(normal);
        patches.reflectance.push_back({0.5F, 0.5F, 0.5F});
      }
    }
  }
  return patches;
}

/// Form factors of patches as small as points, by their centres: one matrix, symmetric.
class KernelMatrix final : public SymmetricMatrix {
 public:
  explicit KernelMatrix(const PatchTable& patches, PatchRoles roles = {})
      : SymmetricMatrix(std::move(roles)), patches_(patches) {
    const auto n = static_cast<Eigen::Index>(patches.size());
    all_.resize(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) all_(i, j) = entry(i, j);
    }
  }

  std::span<const float> area() const override { return patches_.area; }
  void entries(std::uint32_t, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override {
    for (std::size_t j = 0; j < columns.size(); ++j) {
      for (std::size_t i = 0; i < rows.size(); ++i) entries(i, j) = all_(rows[i], columns[j]);
    }
  }
  Eigen::MatrixXf multiply(std::uint32_t, const Eigen::MatrixXf& x) const override {
    return all_ * x;
  }

 private:
  float entry(Eigen::Index i, Eigen::Index j) const {
    float distance = 0, from = 0, to = 0;
    for (int c = 0; c < 3; ++c) {
      const float way = patches_.centroid[j][c] - patches_.centroid[i][c];
      distance += way * way;
      from += way * patches_.normal[i][c];
      to -= way * patches_.normal[j][c];
    }
    if (from <= 0 || to <= 0) return 0;
    const float area = std::sqrt(patches_.area[i] * patches_.area[j]);
    // Not nearer than a patch is large.
    const float least = std::max(distance, patches_.area[i]);
    return from * to * area / (std::numbers::pi_v<float> * least * least);
  }

  const PatchTable& patches_;
  Eigen::MatrixXf all_;
};

/// Each of a few spots of light on the walls, soft at their edges.
std::vector<std::vector<Float3>> spots(const PatchTable& patches, int count, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<std::vector<Float3>> lights;
  for (int k = 0; k < count; ++k) {
    const Float3 at{uniform(engine), uniform(engine), uniform(engine)};
    const float width = 0.1F + 0.4F * uniform(engine);
    std::vector<Float3>& light = lights.emplace_back();
    for (const Float3& p : patches.centroid) {
      const float d = std::hypot(p[0] - at[0], p[1] - at[1], p[2] - at[2]) / width;
      const float m = 1 / (1 + d * d * d * d);
      light.push_back({m, m, m});
    }
  }
  return lights;
}

/// A box that is compressed once, without cluster coefficients.
struct CompressedBox {
  PatchTable patches;
  KernelMatrix matrix;
  CompressionFrame frame;
  std::vector<ClusterWeight> weights;
  CompressionCost cost;
  Storage plain;

  CompressedBox(int side, double multiplier, const PatchRoles& roles = {})
      : patches(box_of(side)),
        matrix(patches, roles),
        frame(compression_frame(matrix, patches, spots(patches, 24, 1))),
        weights(frame.weights()),
        cost{.multiplier = multiplier, .sizes = {.basis_value = 0.55}} {
    const BlockTreeCompressor compressor(matrix, frame.tree, weights, cost.sizes);
    plain = compressor.assemble(compressor.compress(compressor.pieces(), multiplier));
  }

  Storage nested(double multiplier) const {
    const WantedBlocks wanted(frame.roles, frame.tree);
    CompressionCost own = cost;
    own.multiplier = multiplier;
    return nest_bases(plain, {frame.tree, weights, wanted, own});
  }

  double mean_error(const Storage& storage, Precision precision = Precision::kF32) const {
    return mean_error(HierarchicalOperator(encode_values(storage, precision)));
  }

  double mean_error(const HierarchicalOperator& op) const {
    double sum = 0;
    const auto lights = spots(patches, 20, 2);
    for (const std::vector<Float3>& light : lights) {
      sum += relative_difference(product(op, light), truth(light), patches.area);
    }
    return sum / static_cast<double>(lights.size());
  }

  std::vector<Float3> truth(const std::vector<Float3>& light) const {
    const auto n = static_cast<Eigen::Index>(light.size());
    Eigen::MatrixXf x(n, 1);
    for (Eigen::Index i = 0; i < n; ++i) {
      x(i, 0) = matrix.roles().is_source(i) ? light[i][0] * std::sqrt(patches.area[i]) : 0;
    }
    const Eigen::MatrixXf y = matrix.multiply(0, x);
    std::vector<Float3> result(light.size());
    for (Eigen::Index i = 0; i < n; ++i) {
      const float h = y(i, 0) / std::sqrt(patches.area[i]);
      if (matrix.roles().is_receiver(i)) result[i] = {h, h, h};
    }
    return result;
  }
};

std::size_t bytes_of(const Storage& storage) {
  return HierarchicalOperator(encode_values(storage, Precision::kQ8)).bytes();
}

/// 3,456 patches.
const CompressedBox& large_box() {
  static const CompressedBox box(24, 3e-9);
  return box;
}

TEST(PartSizes, BlocksAreFewerIfEachTakesMore) {
  const CompressedBox& box = large_box();
  const auto compressed = [&](const PartSizes& sizes) {
    const BlockTreeCompressor compressor(box.matrix, box.frame.tree, box.weights, sizes);
    return compressor.assemble(compressor.compress(compressor.pieces(), box.cost.multiplier));
  };
  const Storage usual = compressed({.basis_value = 0.55});
  const Storage fewer = compressed({.basis_value = 0.55, .block = 512});
  EXPECT_LE(fewer.blocks.size(), 0.8 * static_cast<double>(usual.blocks.size()));
}

TEST(NestedBases, TakeFewerBytesForLittleMoreError) {
  const CompressedBox& box = large_box();
  const Storage nested = box.nested(box.cost.multiplier);
  ASSERT_FALSE(nested.coefficient_scale.empty());
  EXPECT_LT(bytes_of(nested), 0.85 * static_cast<double>(bytes_of(box.plain)));
  for (const Precision precision : {Precision::kF32, Precision::kF16, Precision::kQ8}) {
    const double before = box.mean_error(box.plain, precision);
    const double after = box.mean_error(nested, precision);
    EXPECT_LT(after, 1.3 * before);
  }
}

TEST(NestedBases, SidesHaveNoMoreVectorsThanClusterBases) {
  // Cluster coefficients at multipliers far above that of the ranks.
  const CompressedBox box(16, 1e-13);
  std::size_t full = 0;
  double last = 0;
  for (const double factor : {1.0, 1e6, 1e8}) {
    const Storage nested = box.nested(factor * box.cost.multiplier);
    ASSERT_FALSE(nested.coefficient_scale.empty());
    for (const TransferBlock& block : nested.blocks) {
      ASSERT_LE(block.row_rank, block.row_count);
      ASSERT_LE(block.column_rank, block.column_count);
      full += factor > 1 && block.kind == TransferBlock::Kind::kLowRank &&
              block.row_rank == block.row_count && block.row_count < 256;
    }
    const double error = box.mean_error(nested);
    EXPECT_GE(error, last) << factor;
    EXPECT_LE(error, 2e-3) << factor;
    last = error;
  }
  EXPECT_GE(full, 3U);  // or none of this was tried
}

TEST(NestedBases, ALowerMultiplierBuysMoreClusterBasesAndLessError) {
  const CompressedBox& box = large_box();
  const double before = box.mean_error(box.plain);
  double previous_error = 1;
  std::size_t previous_coefficients = 0;
  for (const double factor : {30.0, 1.0, 0.03}) {
    const Storage nested = box.nested(factor * box.cost.multiplier);
    const double error = box.mean_error(nested);
    EXPECT_LT(error, previous_error);
    EXPECT_GT(nested.coefficient_scale.size(), previous_coefficients);
    previous_error = error;
    previous_coefficients = nested.coefficient_scale.size();
  }
  EXPECT_LT(previous_error, 1.01 * before) << "all that the blocks have is kept";
}

TEST(NestedBases, VectorsHaveNormOneAndCouplingsFitHalfPrecision) {
  // At a low multiplier lengths of cluster coefficients differ most. Vectors that are all scaled
  // alike, by the longest of them, leave coupling matrices that half precision has as good as
  // nothing for.
  const CompressedBox box(16, 1e-13);
  for (const double factor :
       {1.0, 1e8}) {  // the second has sides with more vectors than cluster coefficients
    const Storage nested = box.nested(factor * box.cost.multiplier);
    const auto positions =
        static_cast<std::uint32_t>(HierarchicalFormat::position_count(box.patches.size()));
    const float* values = nested.values_f32.data();
    float largest = 0;
    for (const TransferBlock& block : nested.blocks) {
      const float* const end = values + block.value_count(nested.matrix_count);
      const bool low_rank = block.kind == TransferBlock::Kind::kLowRank;
      if (low_rank && block.row_begin >= positions) {  // rows come after columns
        const Eigen::Map<const Eigen::MatrixXf> rows(values, block.row_count, block.row_rank);
        EXPECT_NEAR(rows.colwise().norm().minCoeff(), 1, 1e-5);
        EXPECT_NEAR(rows.colwise().norm().maxCoeff(), 1, 1e-5);
        largest = std::max(largest, Eigen::Map<const Eigen::ArrayXf>(
                                        end - Eigen::Index{block.row_rank} * block.column_rank,
                                        Eigen::Index{block.row_rank} * block.column_rank)
                                        .abs()
                                        .maxCoeff());
      }
      values = end;
    }
    EXPECT_LE(largest * HierarchicalFormat::kHalfScale, 33000);
    EXPECT_GE(largest * HierarchicalFormat::kHalfScale, 30000);
  }
}

TEST(NestedBases, SameBitsForAnyNumberOfThreads) {
  const CompressedBox& box = large_box();
  const auto make = [&] { return box.nested(box.cost.multiplier); };
  const Storage one = test::with_threads(1, make), four = test::with_threads(4, make);
  EXPECT_TRUE(std::ranges::equal(one.values_f32, four.values_f32));
  EXPECT_EQ(one.coefficient_scale, four.coefficient_scale);
}

TEST(NestedBases, WhereThereIsNothingToGainNothingChanges) {
  const CompressedBox box(6, 1e-7);
  const Storage nested = box.nested(box.cost.multiplier);
  EXPECT_TRUE(nested.coefficient_scale.empty());
  EXPECT_TRUE(std::ranges::equal(nested.values_f32, box.plain.values_f32));
}

TEST(NestedBases, ServeReceiversAndSources) {
  // Sources are all walls but the first, receivers all but the last.
  constexpr int kSide = 24;
  const std::size_t wall = kSide * kSide;
  PatchRoles roles;
  for (std::size_t k = 0; k < 6 * wall; ++k) {
    const bool source = k >= wall, receiver = k < 5 * wall;
    roles.role.push_back((receiver ? PatchRoles::kReceiver : 0) |
                         (source ? PatchRoles::kSource : 0));
  }
  const CompressedBox box(kSide, 3e-9, roles);
  const Storage nested = box.nested(box.cost.multiplier);
  ASSERT_FALSE(nested.coefficient_scale.empty());
  EXPECT_LT(bytes_of(nested), 0.9 * static_cast<double>(bytes_of(box.plain)));
  EXPECT_LT(box.mean_error(nested, Precision::kQ8),
            1.3 * box.mean_error(box.plain, Precision::kQ8));
}

TEST(NestedBases, AreTakenForATolerance) {
  const CompressedBox& box = large_box();
  const auto training = spots(box.patches, 24, 1), validation = spots(box.patches, 24, 3);
  std::size_t bytes[2];
  for (const bool cluster_bases : {false, true}) {
    const auto op = compress_to_tolerance(box.matrix, box.patches, {training, validation},
                                          {.tolerance = 0.002, .cluster_bases = cluster_bases});
    EXPECT_EQ(op->storage().coefficient_scale.empty(), !cluster_bases);
    EXPECT_LT(box.mean_error(*op), 0.002);
    bytes[cluster_bases ? 1 : 0] = op->bytes();
  }
  EXPECT_LT(bytes[1], bytes[0]);
}

}  // namespace
}  // namespace rebounce::test_nested_bases

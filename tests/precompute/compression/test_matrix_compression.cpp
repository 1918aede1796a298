// The compression of one matrix, and what a light that joins later changes in it.

#include "precompute/compression/matrix_compression.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "precompute/inverse/hierarchical_matrix.h"
#include "tests/support/solved_room.h"
#include "tests/support/unshadowed_lights.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test_matrix_compression {
namespace {

constexpr double kMultiplier = 1e-7;

const test::SolvedRoom& room() {
  static const test::SolvedRoom made(
      test::furnished_room({0.7F, 0.5F, 0.2F}, {0.3F, 0.3F, 0.3F}, {0.1F, 0.3F, 0.9F}), 800);
  return made;
}

/// A 64th of what a patch has, for one patch in five: those at the bottom of slots.
std::vector<std::int8_t> slots() {
  std::mt19937_64 engine(1);
  std::vector<std::int8_t> result(room().patches.size(), 0);
  for (std::int8_t& exponent : result)
    exponent = engine() % 5 == 0 ? std::int8_t{6} : std::int8_t{0};
  return result;
}

std::vector<Float3> light_on(std::size_t patch) {
  std::vector<Float3> light(room().patches.size(), Float3{0, 0, 0});
  light[patch] = {1, 1, 1};
  return light;
}

struct Compressed {
  HierarchicalStorage exact;
  double rounding;  ///< what 8 bits change in the light, relative to it
};

Compressed compress(const MatrixCompression& compression, const std::vector<Float3>& light) {
  Compressed result{compression.at(kMultiplier, {BlockCheckpoint(), {}}), 0};
  const auto lit = [&](Precision precision) {
    return product(HierarchicalOperator(encode_values(result.exact, precision)), light);
  };
  result.rounding =
      relative_difference(lit(Precision::kQ8), lit(Precision::kF32), room().patches.area);
  return result;
}

TEST(MatrixCompression, PositionsThatAJoinedLightShinesOnAloneAreRoundedMoreFinely) {
  const DenseMatrix matrix(*room().dense);
  const std::vector<std::int8_t> exponent = slots();
  const EquilibratedMatrix dark(matrix, exponent);
  const auto training = test::unshadowed_lights(room().patches, 24, 1, 2.2, 0.7);
  const CompressionOptions options{.equilibrated = true, .nested = true};
  double before = 0, after = 0;
  for (std::size_t patch = 0; patch < exponent.size(); patch += 400) {
    const std::vector<Float3> light = light_on(patch);
    MatrixCompression compression(dark, room().patches, training, {}, options);
    const Compressed first = compress(compression, light);
    const ReferenceLighting joined(dark, {light});
    compression.add_training_light(joined, 0);
    const Compressed second = compress(compression, light);
    const std::vector<std::int8_t>&old = first.exact.scale_exponent,
          &changed = second.exact.scale_exponent;
    ASSERT_EQ(old.size(), changed.size());
    for (std::size_t k = 0; k < old.size(); ++k) {
      if (second.exact.patch[k] == patch) {
        EXPECT_LT(changed[k], old[k]);
      } else {
        EXPECT_EQ(changed[k], old[k]);
      }
    }
    before += first.rounding;
    after += second.rounding;
    // The same light again leaves all as it is.
    compression.add_training_light(joined, 0);
    EXPECT_EQ(compress(compression, light).exact.scale_exponent, changed);
  }
  std::printf("rounding changes the light of single patches by %.3g, once they joined by %.3g\n",
              before, after);
  EXPECT_LT(after, 0.5 * before);
}

TEST(MatrixCompression, ALightThatShinesEverywhereLeavesTheScalesAsTheyAre) {
  const DenseMatrix matrix(*room().dense);
  const auto training = test::unshadowed_lights(room().patches, 24, 1, 2.2, 0.7);
  const std::vector<Float3> light(room().patches.size(), Float3{1, 1, 1});
  MatrixCompression compression(matrix, room().patches, training, {},
                                {.equilibrated = true, .nested = true});
  const auto before = compress(compression, light).exact.scale_exponent;
  compression.add_training_light(ReferenceLighting(matrix, {light}), 0);
  EXPECT_EQ(compress(compression, light).exact.scale_exponent, before);
}

/// All pairs as one block of low rank: the matrix v v^T.
HierarchicalOperator one_block(const std::vector<float>& v, const PatchTable& patches) {
  const auto n = static_cast<std::uint32_t>(v.size());
  HierarchicalStorage storage;
  storage.area = patches.area;
  for (std::uint32_t p = 0; p < n; ++p) storage.patch.push_back(p);
  storage.matrix_count = 1;
  const auto positions = static_cast<std::uint32_t>(HierarchicalFormat::position_count(n));
  storage.blocks.push_back({.row_count = positions,
                            .column_count = positions,
                            .kind = TransferBlock::Kind::kLowRank,
                            .row_rank = 1,
                            .column_rank = 1});
  std::vector<float> values(v);
  values.resize(positions, 0.0F);
  values.push_back(1);
  values.resize(values.size() + HierarchicalFormat::kPadding, 0.0F);
  storage.values_f32 = SharedArray(std::move(values));
  return HierarchicalOperator(std::move(storage));
}

TEST(MatrixCompression, BlocksOfLowRankOnTheDiagonalAreCompressedAgain) {
  const PatchTable& patches = room().patches;
  std::vector<float> v;
  for (const float area : patches.area) v.push_back(std::sqrt(area));
  const HierarchicalOperator whole = one_block(v, patches);
  const HierarchicalMatrix matrix(whole.storage());
  const auto training = test::unshadowed_lights(patches, 8, 1, 2.2, 0.7);
  const HierarchicalOperator again(compress_matrix(matrix, patches, training, kMultiplier));
  for (const std::vector<Float3>& light : test::unshadowed_lights(patches, 4, 2, 2.2, 0.7)) {
    EXPECT_LT(relative_difference(product(again, light), product(whole, light), patches.area),
              1e-3);
  }
}

/// A floor of 4 m by 5 m.
PatchTable floor_patches(std::size_t along_x, std::size_t along_z) {
  PatchTable patches;
  const float width = 4.0F / static_cast<float>(along_x),
              depth = 5.0F / static_cast<float>(along_z);
  for (std::size_t k = 0; k < along_x * along_z; ++k) {
    const std::size_t column = k % along_x, row = k / along_x;
    const float x = width * (0.5F + static_cast<float>(column)),
                z = depth * (0.5F + static_cast<float>(row));
    patches.area.push_back(width * depth);
    patches.centroid.push_back({x, 0, z});
    patches.normal.push_back({0, 1, 0});
    patches.reflectance.push_back({0.5F, 0.5F, 0.5F});
  }
  patches.emitted_exitance.resize(patches.size());
  patches.sky_visibility.resize(patches.size());
  patches.absorbed.resize(patches.size());
  return patches;
}

/// A matrix whose largest block that is read is known.
class Watched final : public SymmetricMatrix {
 public:
  Watched(const SymmetricMatrix& matrix, bool has_parts) : matrix_(matrix), has_parts_(has_parts) {}

  std::span<const float> area() const override { return matrix_.area(); }
  void entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
               std::span<const std::uint32_t> columns,
               Eigen::Ref<Eigen::MatrixXf> entries) const override {
    const std::size_t side = std::max(rows.size(), columns.size());
    for (std::size_t before = largest; before < side;) {
      if (largest.compare_exchange_weak(before, side)) break;
    }
    matrix_.entries(matrix, rows, columns, entries);
  }
  bool has_parts() const override { return has_parts_; }
  std::optional<JointEntryParts> parts(std::span<const std::uint32_t> rows,
                                       std::span<const std::uint32_t> columns) const override {
    return matrix_.parts(rows, columns);
  }
  Eigen::MatrixXf multiply(std::uint32_t matrix, const Eigen::MatrixXf& x) const override {
    return matrix_.multiply(matrix, x);
  }
  Eigen::VectorXd energies(std::span<const std::uint32_t> /*order*/) const override {
    return Eigen::VectorXd::Ones(static_cast<Eigen::Index>(area().size()));
  }

  mutable std::atomic<std::size_t> largest = 0;

 private:
  const SymmetricMatrix& matrix_;
  bool has_parts_;
};

TEST(MatrixCompression, LargeBlocksOfPartsAreCompressedWithoutBeingRead) {
  constexpr double kFine = kMultiplier / 100;
  const PatchTable patches = floor_patches(72, 72);  // pieces of more than 512 positions
  std::vector<float> v;
  for (const Float3& at : patches.centroid) v.push_back(0.01F * std::exp(-0.3F * at[0] * at[2]));
  const HierarchicalOperator whole = one_block(v, patches);
  const HierarchicalMatrix matrix(whole.storage());
  const auto training = test::unshadowed_lights(patches, 8, 1, 0, 2);
  const Watched read(matrix, false), multiplied(matrix, true);
  const HierarchicalOperator of_entries(compress_matrix(read, patches, training, kFine)),
      of_parts(compress_matrix(multiplied, patches, training, kFine));
  EXPECT_GT(read.largest, 512U);
  EXPECT_LE(multiplied.largest, 512U);
  EXPECT_NEAR(static_cast<double>(of_parts.bytes()) / static_cast<double>(of_entries.bytes()), 1,
              0.02);
  for (const std::vector<Float3>& light : test::unshadowed_lights(patches, 4, 2, 0, 2)) {
    const auto truth = product(whole, light);
    EXPECT_LT(relative_difference(product(of_entries, light), truth, patches.area), 1e-3);
    EXPECT_LT(relative_difference(product(of_parts, light), truth, patches.area), 1e-3);
  }
}

}  // namespace
}  // namespace rebounce::test_matrix_compression

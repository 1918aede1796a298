// A file that an earlier build wrote is read as it was meant: tests/golden/format_N.safetensors, N
// the version of the format. Where the format gets a new version, remove the file of the old one
// and make the new one from the sample below:
//
//   REBOUNCE_WRITE_GOLDEN=1 build/release/tests/test_transfer --gtest_filter='GoldenFile.*'
//
// The numbers expected here stay as they are where the new version only stores them in another way.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/hierarchical_samples.h"
#include "tests/support/plain_data.h"
#include "tests/support/temporary_folder.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/format/hierarchical_values.h"
#include "transfer/format/row_format.h"
#include "transfer/operator/hierarchical_operator.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce::test_golden_file {
namespace {

constexpr std::size_t kPatchCount = 100;

// The step of the coupling matrices that have most bits.
constexpr float kFinestStep = 0x1p-20F;

/// Blocks of all kinds with residuals and scales, bases in bytes; form factors in 16 bits, and a
/// few of pairs.
TransferData sample() {
  HierarchicalStorage nested =
      test::equilibrated(test::random_nested_storage(kPatchCount, 2, 5), 6);
  // Coupling matrices of all widths.
  for (std::size_t k = 0; TransferBlock & block : nested.blocks) {
    if (block.kind == TransferBlock::Kind::kLowRank)
      block.coupling_step = std::ldexp(kFinestStep, 4 * static_cast<int>(k++ % 4));
  }
  TransferData data = test::plain_data(nested.area);
  data.transfer =
      std::make_shared<const HierarchicalOperator>(encode_values(nested, Precision::kQ8));
  HierarchicalStorage plain = test::random_hierarchical_storage(kPatchCount, 1, 7);
  plain.area = nested.area;
  data.compressed_form_factors =
      std::make_shared<const HierarchicalOperator>(encode_values(plain, Precision::kF16));
  std::vector<std::uint64_t> row_begin(kPatchCount + 1, 3);
  row_begin[0] = 0;
  row_begin[1] = 2;
  data.exchange = {SharedArray(std::move(row_begin)), SharedArray(std::vector{1U, 99U, 2U}),
                   SharedArray(std::vector{0.25F, 0.5F, 0.125F})};
  data.record = {.generator = "rebounce golden",
                 .scene_name = "none.gltf",
                 .scene_hash = "xxh3:00112233445566778899aabbccddeeff",
                 .solve_residual = 0.0625,
                 .tolerance = 0.005,
                 .error_mean = 0.004,
                 .error_max = 0.02,
                 .error_bound = 0.03};
  data.settings_json = R"({"seed":1})";
  data.report_json = R"({"rays":2})";
  return data;
}

std::filesystem::path golden_file() {
  const std::string name = "format_" + std::to_string(kFileFormatVersion) + ".safetensors";
  std::filesystem::path path = std::filesystem::path(REBOUNCE_SOURCE_DIR) / "tests/golden" / name;
  if (std::getenv("REBOUNCE_WRITE_GOLDEN") != nullptr) save_transfer_file(path, sample());
  return path;
}

/// Small whole numbers; no two patches have the same three.
std::vector<Float3> light() {
  std::vector<Float3> light(kPatchCount);
  for (std::size_t i = 0; i < kPatchCount; ++i) {
    light[i] = {static_cast<float>(1 + i % 7), static_cast<float>(1 + i % 5),
                static_cast<float>(1 + i % 3)};
  }
  return light;
}

struct Expected {
  std::array<Float3, 4> of_patches;  ///< 0, 33, 66, 99
  std::array<double, 3> weighted_sum;
};

/// The product with `light()`, which the values of the file give in double precision. It is
/// computed with these values in single precision: integer bases take light that is rounded to
/// integers. Sets of instructions add in an order of their own, 3e-6 of the largest in all. Values
/// in another order change it by a hundredth or more.
void expect_product(const HierarchicalOperator& stored, const Expected& expected) {
  const HierarchicalOperator op(decode(stored.storage()));
  const std::vector<Float3> h = product(op, light());
  float most = 0;
  std::array<double, 3> sum = {}, magnitude = {};
  for (std::size_t i = 0; i < kPatchCount; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      most = std::max(most, std::abs(h[i][c]));
      sum[c] += static_cast<double>(1 + i % 11) * h[i][c];
      magnitude[c] += static_cast<double>(1 + i % 11) * std::abs(h[i][c]);
    }
  }
  for (std::size_t k = 0; k < expected.of_patches.size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(h[33 * k][c], expected.of_patches[k][c], 1e-5 * most) << 33 * k << ", " << c;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(sum[c], expected.weighted_sum[c], 1e-5 * magnitude[c]) << c;
  }
}

TEST(GoldenFile, HoldsBlocksOfAllKinds) {
  const TransferData data = load_transfer_file(golden_file());
  const auto& storage = dynamic_cast<const HierarchicalOperator&>(*data.transfer).storage();
  EXPECT_EQ(storage.precision, hierarchical_precision(Precision::kQ8));
  for (const auto kind : {TransferBlock::Kind::kDense, TransferBlock::Kind::kLowRank,
                          TransferBlock::Kind::kClusterBasis}) {
    EXPECT_GT(std::ranges::count(storage.blocks, kind, &TransferBlock::kind), 0);
  }
  EXPECT_TRUE(std::ranges::any_of(storage.blocks, &TransferBlock::row_residual_rank));
  for (const unsigned bits : {4U, 8U, 12U, 16U}) {
    EXPECT_TRUE(std::ranges::any_of(storage.row_format, [bits](std::uint8_t format) {
      return RowFormat{format}.bits() == bits;
    })) << bits;
  }
  EXPECT_EQ(storage.scale_exponent.size(), kPatchCount);
}

TEST(GoldenFile, GivesTheProductThatItGaveWhenItWasMade) {
  const TransferData data = load_transfer_file(golden_file());
  expect_product(dynamic_cast<const HierarchicalOperator&>(*data.transfer),
                 {.of_patches = {{{1.71621F, 1.940063F, 1.184446F},
                                  {7.378204F, 6.468764F, 4.606769F},
                                  {0.713775F, 0.5880924F, 0.3961883F},
                                  {0.2719044F, 0.2118148F, 0.1247208F}}},
                  .weighted_sum = {2559.25202, 2110.32843, 1276.33787}});
  expect_product(*data.compressed_form_factors,
                 {.of_patches = {{{10.75447F, 8.699661F, 5.52881F},
                                  {11.54727F, 8.915014F, 5.999148F},
                                  {12.25619F, 10.43016F, 6.456101F},
                                  {25.97236F, 20.93385F, 13.22315F}}},
                  .weighted_sum = {8530.01953, 6674.53243, 4294.21245}});
}

TEST(GoldenFile, HoldsItsPatchesAndFormFactors) {
  const TransferData data = load_transfer_file(golden_file());
  const std::vector<float>& area = data.patches.area;
  ASSERT_EQ(area.size(), kPatchCount);
  EXPECT_EQ(area[0], 0.773064911F);
  EXPECT_EQ(area[99], 0.151357725F);
  EXPECT_NEAR(std::accumulate(area.begin(), area.end(), 0.0), 55.096463069319725, 1e-9);
  EXPECT_EQ(data.patches.reflectance[50], (Float3{0.5F, 0.25F, 0.5F}));
  EXPECT_TRUE(std::ranges::equal(data.exchange.column, std::vector{1U, 99U, 2U}));
  EXPECT_TRUE(std::ranges::equal(data.exchange.exchange_area, std::vector{0.25F, 0.5F, 0.125F}));
}

TEST(GoldenFile, HoldsItsRecord) {
  const TransferData loaded = load_transfer_file(golden_file());
  const TransferData sampled = sample();
  EXPECT_EQ(loaded.settings_json, sampled.settings_json);
  EXPECT_EQ(loaded.report_json, sampled.report_json);
  const BuildRecord &record = loaded.record, &expected = sampled.record;
  EXPECT_EQ(record.generator, expected.generator);
  EXPECT_EQ(record.scene_name, expected.scene_name);
  EXPECT_EQ(record.scene_hash, expected.scene_hash);
  EXPECT_EQ(record.solve_residual, expected.solve_residual);
  EXPECT_EQ(record.tolerance, expected.tolerance);
  EXPECT_EQ(record.error_mean, expected.error_mean);
  EXPECT_EQ(record.error_max, expected.error_max);
  EXPECT_EQ(record.error_bound, expected.error_bound);
}

TEST(GoldenFile, IsWrittenAgainToTheByte) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "again", load_transfer_file(golden_file()));
  EXPECT_EQ(test::read_bytes(folder / "again"), test::read_bytes(golden_file()));
}

}  // namespace
}  // namespace rebounce::test_golden_file

// Storage of which no hierarchical operator can be made.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "rebounce/error.h"
#include "tests/support/expect_error.h"
#include "tests/support/hierarchical_samples.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test_hierarchical_refusals {
namespace {

using test::expect_error;
using test::random_hierarchical_storage;
using test::random_nested_storage;
using Storage = HierarchicalStorage;

struct Fault {
  const char* message;  ///< a part of it
  std::function<void(Storage&)> make;
};

void expect_refused(const Storage& good, const std::vector<Fault>& faults) {
  ASSERT_NO_THROW(HierarchicalOperator{good});
  for (std::size_t k = 0; k < faults.size(); ++k) {
    SCOPED_TRACE("fault " + std::to_string(k) + ": " + faults[k].message);
    Storage storage = good;
    faults[k].make(storage);
    expect_error([&] { HierarchicalOperator{storage}; }, faults[k].message);
  }
}

TEST(HierarchicalOperator, RefusesToRoundTwice) {
  const HierarchicalStorage exact = random_hierarchical_storage(100, 1, 1);
  for (const Precision first : {Precision::kF16, Precision::kQ8}) {
    const HierarchicalStorage rounded = encode_values(exact, first);
    for (const Precision second : {Precision::kF32, Precision::kF16, Precision::kQ8}) {
      EXPECT_THROW(encode_values(rounded, second), Error)
          << precision_name(first) << " to " << precision_name(second);
    }
  }
}

TEST(HierarchicalOperator, RefusesStorageThatDoesNotFit) {
  using Kind = TransferBlock::Kind;
  ASSERT_TRUE(random_hierarchical_storage(100, 3, 1).blocks[0].on_diagonal());
  expect_refused(
      random_hierarchical_storage(100, 3, 1),
      {
          {"no patches", [](Storage& s) { s.area.clear(), s.patch.clear(), s.blocks.clear(); }},
          {"matrices is not 1, 2 or 3", [](Storage& s) { s.matrix_count = 0; }},
          {"matrices is not 1, 2 or 3", [](Storage& s) { s.matrix_count = 4; }},
          {"has no matrix", [](Storage& s) { s.channel_matrix[1] = 3; }},
          {"not one position", [](Storage& s) { s.patch.pop_back(); }},
          {"not a permutation", [](Storage& s) { s.patch[3] = s.patch[4]; }},
          {"not a permutation", [](Storage& s) { s.patch[3] = 100; }},
          {"reaches outside", [](Storage& s) { s.blocks[0].row_begin = 112; }},
          {"reaches outside", [](Storage& s) { s.blocks[0].column_begin = 4294967280U; }},
          {"reaches outside", [](Storage& s) { s.blocks[0].row_count = 4294967280U; }},
          {"empty", [](Storage& s) { s.blocks[0].row_count = 0; }},
          {"not aligned", [](Storage& s) { s.blocks[0].row_count = 8; }},
          {"nor below", [](Storage& s) { s.blocks[0].column_begin = 16; }},
          {"nor below", [](Storage& s) { s.blocks[0].column_count += 16; }},
          {"unknown kind", [](Storage& s) { s.blocks[0].kind = static_cast<Kind>(3); }},
          {"dense block has a rank",
           [](Storage& s) {
             s.blocks[0].kind = Kind::kDense;
             s.blocks[0].row_rank = 1;
           }},
          {"ranks",
           [](Storage& s) {
             s.blocks[0].kind = Kind::kLowRank;
             s.blocks[0].row_rank = s.blocks[0].column_rank = 200;
           }},
          {"ranks",
           [](Storage& s) {
             s.blocks[0].kind = Kind::kLowRank;
             s.blocks[0].row_rank = 1;
             s.blocks[0].column_rank = 2;
           }},
          {"dense block has a rank",
           [](Storage& s) {
             s.blocks[0].kind = Kind::kDense;
             s.blocks[0].row_residual_rank = 1;
           }},
          {"residual ranks of a block",
           [](Storage& s) {
             s.blocks[0].kind = Kind::kLowRank;
             s.blocks[0].row_rank = s.blocks[0].column_rank = 2;
             s.blocks[0].row_residual_rank = s.blocks[0].column_residual_rank = 3;
           }},
          {"residual ranks of a block",
           [](Storage& s) {
             s.blocks[0].kind = Kind::kLowRank;
             s.blocks[0].row_rank = s.blocks[0].column_rank = 2;
             s.blocks[0].row_residual_rank = 1;
             s.blocks[0].column_residual_rank = 0;
           }},
          {"not in 8 bits",
           [](Storage& s) {
             s.precision = hierarchical_precision(Precision::kF16);
             s.blocks[0].kind = Kind::kLowRank;
             s.blocks[0].row_rank = s.blocks[0].column_rank = 2;
             s.blocks[0].row_residual_rank = s.blocks[0].column_residual_rank = 1;
           }},
          {"cannot be combined",
           [](Storage& s) { s.precision.couplings = CouplingPrecision::kF16; }},
          {"a value is not finite",
           [](Storage& s) {
             std::vector<float> values(s.values_f32.begin(), s.values_f32.end());
             values[7] = -std::numeric_limits<float>::infinity();
             s.values_f32 = SharedArray(std::move(values));
           }},
          {"a value is not finite",
           [](Storage& s) {
             s = encode_values(s, Precision::kF16);
             std::vector<std::uint16_t> values(s.values_f16.begin(), s.values_f16.end());
             values[7] = 0x7E00;  // NaN
             s.values_f16 = SharedArray(std::move(values));
           }},
          {"number of values", [](Storage& s) { s.blocks.pop_back(); }},
          {"number of values", [](Storage& s) { s.order = HierarchicalStorage::Order::kStreamed; }},
          {"number of values",
           [](Storage& s) {
             s.precision = hierarchical_precision(Precision::kF16);
             for (TransferBlock& block : s.blocks)
               block.row_residual_rank = block.column_residual_rank = 0;
           }},
      });
}

TEST(NestedOperator, RefusesClusterBasesThatDoNotFit) {
  expect_refused(
      random_nested_storage(1000, 3, 1),
      {
          {"not numbered in the order", [](Storage& s) { s.blocks[1].column_begin += 16; }},
          {"not numbered in the order", [](Storage& s) { std::swap(s.blocks[0], s.blocks[1]); }},
          {"not numbered in the order", [](Storage& s) { s.blocks[0].column_count = 4294967295U; }},
          {"a cluster basis is not over positions",
           [](Storage& s) { s.blocks[0].row_begin = 1008; }},
          {"a cluster basis is not over positions", [](Storage& s) { s.blocks[0].row_count = 24; }},
          {"rank of a cluster basis", [](Storage& s) { s.blocks[0].row_rank = 4; }},
          {"rank of a cluster basis", [](Storage& s) { s.blocks[0].column_rank = 1; }},
          {"rank of a cluster basis", [](Storage& s) { s.blocks[0].row_residual_rank = 6; }},
          {"rank of a cluster basis", [](Storage& s) { s.blocks[0].column_residual_rank = 1; }},
          {"one scale for each cluster coefficient",
           [](Storage& s) { s.coefficient_scale.pop_back(); }},
          {"one scale for each cluster coefficient",
           [](Storage& s) { s.coefficient_scale.push_back(1); }},
          {"not finite", [](Storage& s) { s.coefficient_scale[3] = std::nanf(""); }},
          {"reaches outside",
           [](Storage& s) {
             for (TransferBlock& block : s.blocks) {
               if (block.kind != TransferBlock::Kind::kDense) continue;
               block.row_begin = block.column_begin = 1008;
               break;
             }
           }},
          {"reaches outside",
           [](Storage& s) {
             for (TransferBlock& block : s.blocks) {
               if (block.kind == TransferBlock::Kind::kLowRank) block.row_begin = 1008 - 16;
             }
           }},
          {"number of values", [](Storage& s) { s.blocks.pop_back(); }},
      });
}

TEST(EquilibratedOperator, RefusesScalesThatDoNotFit) {
  HierarchicalStorage storage = random_hierarchical_storage(100, 1, 1);
  storage.scale_exponent.assign(99, 0);
  expect_error([&] { HierarchicalOperator{storage}; }, "one scale for each position");
  storage.scale_exponent.assign(100, 0);
  for (const std::int8_t exponent : {25, -25, 127, -128}) {
    storage.scale_exponent[7] = exponent;
    expect_error([&] { HierarchicalOperator{storage}; }, "beyond 2^+-24");
  }
}

TEST(HierarchicalOperator, RefusesHalfPrecisionBeyondItsRange) {
  HierarchicalStorage storage = random_hierarchical_storage(100, 1, 1);
  storage.values_f32 =
      SharedArray(std::vector<float>(storage.values_f32.size(), 130.0F));  // x 512 is too much
  expect_error([&] { encode_values(storage, Precision::kF16); }, "too large for f16");
}

TEST(HierarchicalOperator, RefusesPackedRowsThatDoNotFit) {
  expect_refused(encode_values(random_hierarchical_storage(100, 3, 1), Precision::kQ8),
                 {{"one format for each row", [](Storage& s) { s.row_format.pop_back(); }},
                  {"one format for each row", [](Storage& s) { s.row_format.push_back(0); }},
                  {"one format for each row", [](Storage& s) { s.row_format.clear(); }},
                  {"number of values",
                   [](Storage& s) {
                     for (std::uint8_t& format : s.row_format) format &= 0xFCU;  // rows of 4 bits
                   }},
                  {"number of values", [](Storage& s) { s.packed_couplings = {}; }},
                  {"number of values", [](Storage& s) {
                     s.packed_couplings = SharedArray(std::vector<std::uint8_t>(
                         s.packed_couplings.begin(), s.packed_couplings.end() - 1));
                   }}});
  expect_refused(random_hierarchical_storage(100, 3, 1),
                 {{"one format for each row", [](Storage& s) { s.row_format = {3}; }},
                  {"number of values", [](Storage& s) {
                     s.packed_couplings = SharedArray(std::vector<std::uint8_t>(64));
                   }}});
}

}  // namespace
}  // namespace rebounce::test_hierarchical_refusals

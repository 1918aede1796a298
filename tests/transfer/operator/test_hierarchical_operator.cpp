#include "transfer/operator/hierarchical_operator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/hierarchical_samples.h"
#include "tests/support/operator_checks.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce::test_hierarchical_operator {
namespace {

using test::check_batch;
using test::check_receivers;
using test::multiply_expansion;
using test::random_hierarchical_storage;
using test::unaided_product;

/// A kind of operator with random values of so many patches, with so many matrices.
struct Kind {
  const char* name;
  HierarchicalStorage (*make)(std::size_t patches, std::uint32_t matrices, std::uint64_t seed);
  /// What an apply may differ from plain sums over the same stored values: by the rounding of sums
  /// or, of bytes, of light.
  double of_sums, of_bytes;
};

HierarchicalStorage scaled_storage(std::size_t patches, std::uint32_t matrices,
                                   std::uint64_t seed) {
  return test::equilibrated(test::random_nested_storage(patches, matrices, seed), seed + 1);
}

HierarchicalStorage storage_with_roles(std::size_t patches, std::uint32_t matrices,
                                       std::uint64_t seed) {
  return test::with_roles(random_hierarchical_storage(patches, matrices, seed));
}

constexpr Kind kKinds[] = {{"Plain", random_hierarchical_storage, 2e-6, 5e-5},
                           {"Nested", test::random_nested_storage, 5e-6, 1e-4},
                           {"Equilibrated", scaled_storage, 5e-6, 1e-4},
                           {"WithRoles", storage_with_roles, 2e-6, 5e-5}};

class EveryOperator : public testing::TestWithParam<Kind> {
 protected:
  static HierarchicalOperator make(std::size_t patches, std::uint32_t matrices, std::uint64_t seed,
                                   Precision precision = Precision::kF32) {
    return HierarchicalOperator(encode_values(GetParam().make(patches, matrices, seed), precision));
  }
};

INSTANTIATE_TEST_SUITE_P(HierarchicalOperator, EveryOperator, testing::ValuesIn(kKinds),
                         [](const auto& instance) { return instance.param.name; });

TEST_P(EveryOperator, MultipliesLikeItsExpansionInEveryPrecision) {
  for (const std::size_t n : {1U, 15U, 16U, 17U, 100U, 333U, 1000U}) {
    for (const std::uint32_t matrices : {1U, 2U, 3U}) {
      const std::vector<Float3> m0 = test::random_light(n, n, 100);
      for (const Precision precision : test::kPrecisions) {
        const HierarchicalOperator op = make(n, matrices, 7 * n + matrices, precision);
        EXPECT_LT(relative_difference(unaided_product(op, m0), multiply_expansion(op, m0),
                                      op.storage().area),
                  precision == Precision::kQ8 ? GetParam().of_bytes : GetParam().of_sums)
            << n << " patches, " << matrices << " matrices, " << precision_name(precision);
      }
    }
  }
}

TEST_P(EveryOperator, SameBitsForAnyNumberOfThreads) {
  for (const Precision precision : test::kPrecisions) {
    test::expect_same_bits_for_any_number_of_threads(make(1000, 3, 6, precision));
  }
}

TEST_P(EveryOperator, ABatchIsAsManyApplies) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    for (const Precision precision : test::kPrecisions) {
      const HierarchicalOperator op = make(333, matrices, 40 + matrices, precision);
      for (const std::size_t lights : {1U, 2U, 3U, 5U}) check_batch(op, lights);
    }
  }
}

TEST_P(EveryOperator, PlanesAreTheChannelsOfLights) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    for (const Precision precision : test::kPrecisions) {
      const HierarchicalOperator op = make(333, matrices, 60 + matrices, precision);
      // Coefficients of bytes are rounded together with those of the same light.
      const float allowed = precision == Precision::kQ8 ? 5e-4F : 1e-6F;
      for (const std::size_t lights : {1U, 2U, 4U}) test::check_planes(op, lights, allowed);
    }
  }
}

TEST_P(EveryOperator, AllocatesNothing) {
  test::expect_no_allocations(make(500, 3, 8));
}

TEST(HierarchicalOperator, ReceiversGetWhatAnApplyGivesThemAndNothingElseIsTouched) {
  for (const Kind& kind : std::span(kKinds).first(3)) {
    SCOPED_TRACE(kind.name);
    check_receivers(HierarchicalOperator(kind.make(777, 3, 12)), 1e-6F);
    check_receivers(HierarchicalOperator(kind.make(1000, 3, 7003)), 1e-6F);
    // Coefficients are rounded by the largest of those that are wanted.
    check_receivers(HierarchicalOperator(encode_values(kind.make(1000, 3, 7003), Precision::kQ8)),
                    5e-4F);
  }
}

TEST(HierarchicalOperator, TheTestOperatorHasBlocksOfAllKinds) {
  int dense = 0, low_rank = 0, zero = 0, dense_diagonal = 0, low_rank_diagonal = 0;
  for (const TransferBlock& block : random_hierarchical_storage(1000, 3, 7003).blocks) {
    const bool is_dense = block.kind == TransferBlock::Kind::kDense;
    (block.on_diagonal() ? (is_dense ? dense_diagonal : low_rank_diagonal)
                         : (is_dense ? dense : low_rank))++;
    if (!is_dense && block.row_rank == 0) ++zero;
  }
  for (const int count : {dense, low_rank, zero, dense_diagonal, low_rank_diagonal}) {
    EXPECT_GT(count, 3);
  }
}

TEST(HierarchicalOperator, ExpansionIsSymmetricInTheAreaNorm) {
  const HierarchicalOperator op(random_hierarchical_storage(200, 3, 4));
  const std::vector<float>& area = op.storage().area;
  std::vector<float> y(200 * 200);
  op.expand(1, y);
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const float a = area[i] * y[i * 200 + j], b = area[j] * y[j * 200 + i];
      EXPECT_NEAR(a, b, 1e-6 + 1e-5 * std::abs(a));
    }
  }
}

/// How exact a product is whose values are stored in a precision.
struct Exactness {
  Precision precision;
  double bytes;        ///< at most, as a part of those of single precision
  double rounding;     ///< of light on its way: a product against plain sums of the same values
  double least, most;  ///< error by the rounding of values
};

// Values of 8 bits have 7 and a sign, halves 11; an entry of a block of low rank is a product of
// three. Light is rounded twice on its way, to 15 bits for bytes; for halves only sums round.
constexpr Exactness kExactness[] = {{Precision::kF16, 0.6, 2e-6, 1e-6, 1e-3},
                                    {Precision::kQ8, 0.5, 5e-5, 1e-5, 5e-3}};

TEST(HierarchicalOperator, EveryPrecisionIsAsGoodAsItsBits) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    const HierarchicalStorage storage = random_hierarchical_storage(500, matrices, 5);
    const HierarchicalOperator exact(storage);
    const std::vector<Float3> m0 = test::random_light(500, 1, 100);
    const std::vector<float>& area = storage.area;
    for (const Exactness& expected : kExactness) {
      SCOPED_TRACE(std::string(precision_name(expected.precision)) + ", " +
                   std::to_string(matrices) + " matrices");
      const HierarchicalOperator rounded(encode_values(storage, expected.precision));
      const std::vector<Float3> h = unaided_product(rounded, m0);
      EXPECT_LT(static_cast<double>(rounded.bytes()),
                expected.bytes * static_cast<double>(exact.bytes()));
      EXPECT_LT(relative_difference(h, multiply_expansion(rounded, m0), area), expected.rounding);
      const double error = relative_difference(h, unaided_product(exact, m0), area);
      EXPECT_LT(error, expected.most);
      EXPECT_GT(error, expected.least);
    }
    const HierarchicalOperator half(encode_values(storage, Precision::kF16));
    EXPECT_EQ(2 * half.storage().values_f16.size_bytes(), exact.storage().values_f32.size_bytes());
  }
}

TEST(HierarchicalOperator, TheOrderOfTheValuesMakesNoDifference) {
  const HierarchicalStorage by_block = random_hierarchical_storage(500, 2, 9);
  const HierarchicalStorage streamed = stream_values(by_block);
  const std::vector<Float3> m0 = test::random_light(500, 5, 100);
  EXPECT_EQ(streamed.order, HierarchicalStorage::Order::kStreamed);
  EXPECT_EQ(streamed.values_f32.size() % 64, 0U);
  EXPECT_EQ(unaided_product(HierarchicalOperator(by_block), m0),
            unaided_product(HierarchicalOperator(streamed), m0));
}

}  // namespace
}  // namespace rebounce::test_hierarchical_operator

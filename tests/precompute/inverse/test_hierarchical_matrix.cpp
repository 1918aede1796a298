// A hierarchical operator read by its entries and multiplied with many vectors.

#include "precompute/inverse/hierarchical_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "tests/support/hierarchical_samples.h"
#include "tests/support/with_threads.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce::test_hierarchical_matrix {
namespace {

constexpr std::size_t kPatchCount = 340;

/// What products are given by: irradiance from exitance, one channel.
Eigen::MatrixXf expanded(const HierarchicalOperator& transfer, int channel) {
  const std::size_t n = transfer.patch_count();
  std::vector<float> entries(n * n);
  transfer.expand(channel, entries);
  Eigen::MatrixXf result(n, n);
  const auto& area = transfer.storage().area;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      result(i, j) = entries[i * n + j] * std::sqrt(area[i] / area[j]);
    }
  }
  return result;
}

struct Kind {
  Precision precision;
  bool equilibrated = false;
};

HierarchicalOperator sample(const Kind& kind) {
  HierarchicalStorage storage = test::random_hierarchical_storage(kPatchCount, 2, 5);
  if (kind.equilibrated) storage = test::equilibrated(std::move(storage), 6);
  return HierarchicalOperator(encode_values(storage, kind.precision));
}

class HierarchicalMatrixOf : public testing::TestWithParam<Kind> {
 protected:
  HierarchicalOperator transfer = sample(GetParam());
  HierarchicalMatrix matrix{transfer.storage()};
};

TEST_P(HierarchicalMatrixOf, EntriesAreThoseOfTheOperator) {
  std::vector<std::uint32_t> all(kPatchCount);
  std::iota(all.begin(), all.end(), 0U);
  std::ranges::shuffle(all, std::mt19937(1));
  const std::span patches(all);
  for (int channel = 0; channel < kChannelCount; ++channel) {
    const Eigen::MatrixXf truth = expanded(transfer, channel);
    const float allowed = 1e-5F * truth.cwiseAbs().maxCoeff();
    for (const auto& [rows, columns] : {std::pair(patches.first(150), patches.last(100)),
                                        std::pair(patches.first(90), patches.first(90))}) {
      Eigen::MatrixXf entries(rows.size(), columns.size());
      matrix.entries(matrix.channel_matrix()[channel], rows, columns, entries);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        for (std::size_t j = 0; j < columns.size(); ++j) {
          ASSERT_NEAR(entries(i, j), truth(rows[i], columns[j]), allowed);
        }
      }
    }
  }
}

TEST_P(HierarchicalMatrixOf, ProductsAreThoseOfItsEntries) {
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(kPatchCount, 40);  // more than one group
  for (int channel = 0; channel < kChannelCount; ++channel) {
    const Eigen::MatrixXf truth = expanded(transfer, channel) * x;
    const Eigen::MatrixXf y = matrix.multiply(matrix.channel_matrix()[channel], x);
    EXPECT_LT((y - truth).norm(), 1e-5F * truth.norm());
  }
}

TEST_P(HierarchicalMatrixOf, WhatIsDarkIsLeftOutOfProducts) {
  const Eigen::Index n = matrix.position_count();
  HierarchicalMatrix::Workspace workspace;
  HierarchicalMatrix::Vectors of_part, sum = HierarchicalMatrix::Vectors::Zero(n, 3), all;
  const HierarchicalMatrix::Vectors x = HierarchicalMatrix::Vectors::Random(n, 3);
  for (const auto& [begin, end] : {std::pair(0, 20), std::pair(20, 21), std::pair(21, int(n))}) {
    HierarchicalMatrix::Vectors part = HierarchicalMatrix::Vectors::Zero(n, 3);
    part.middleRows(begin, end - begin) = x.middleRows(begin, end - begin);
    matrix.multiply(0, part, of_part, workspace);
    sum += of_part;
  }
  matrix.multiply(0, x, all, workspace);
  EXPECT_LT((sum - all).norm(), 1e-5F * all.norm());
  matrix.multiply(0, HierarchicalMatrix::Vectors::Zero(n, 3), all, workspace);
  EXPECT_EQ(all.norm(), 0);
}

TEST_P(HierarchicalMatrixOf, SameBitsForAnyNumberOfThreads) {
  const Eigen::MatrixXf x = Eigen::MatrixXf::Random(kPatchCount, 100);
  const auto make = [&] { return matrix.multiply(0, x); };
  const Eigen::MatrixXf one = test::with_threads(1, make), four = test::with_threads(4, make);
  EXPECT_EQ(one, four);
}

TEST_P(HierarchicalMatrixOf, PartsAddUpToItsEntries) {
  std::vector<std::uint32_t> order(transfer.storage().patch);  // by position
  std::mt19937 random(3);
  int found = 0, left = 0;
  const auto check = [&](std::span<const std::uint32_t> rows,
                         std::span<const std::uint32_t> columns) {
    const auto parts = matrix.parts(rows, columns);
    (parts ? found : left) += 1;
    if (!parts) return;
    for (std::uint32_t m = 0; m < matrix.matrix_count(); ++m) {
      Eigen::MatrixXf entries(rows.size(), columns.size());
      matrix.entries(m, rows, columns, entries);
      const RowVectors x = RowVectors::Random(entries.cols(), 3),
                       z = RowVectors::Random(entries.rows(), 3);
      RowVectors y = RowVectors::Zero(entries.rows(), 3), w = RowVectors::Zero(entries.cols(), 3);
      add_product(parts->own[m], x, y);
      add_transposed_product(parts->own[m], z, w);
      EXPECT_LE((y - entries * x).norm(), 1e-5F * (entries * x).norm());
      EXPECT_LE((w - entries.transpose() * z).norm(), 1e-5F * (entries.transpose() * z).norm());
    }
  };
  for (const bool shuffled : {false, true}) {
    if (shuffled) std::ranges::shuffle(order, random);
    const std::span patches(order);
    for (std::size_t row = 0; row + 64 <= kPatchCount; row += 16) {
      for (std::size_t column = 0; column + 64 <= row; column += 16) {
        check(patches.subspan(row, 64), patches.subspan(column, 48));
        check(patches.subspan(column, 48), patches.subspan(row, 64));
      }
    }
    check(patches, patches);
  }
  EXPECT_GT(found, 0);
  EXPECT_GT(left, 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, HierarchicalMatrixOf,
                         testing::Values(Kind{Precision::kF32}, Kind{Precision::kF16},
                                         Kind{Precision::kQ8}, Kind{Precision::kF32, true},
                                         Kind{Precision::kQ8, true}),
                         [](const auto& kind) {
                           return std::string(precision_name(kind.param.precision)) +
                                  (kind.param.equilibrated ? "_equilibrated" : "");
                         });

}  // namespace
}  // namespace rebounce::test_hierarchical_matrix

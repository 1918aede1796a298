#include "transfer/operator/dense_operator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "rebounce/error.h"
#include "tests/support/expect_error.h"
#include "tests/support/operator_checks.h"
#include "tests/support/random_light.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/half_float.h"
#include "transfer/kernels/kernels.h"

namespace rebounce::test_dense_operator {
namespace {

constexpr std::size_t kTile = DenseOperator::kTile;

/// A random operator: symmetric matrices of n patches, and the same matrices in plain form.
struct RandomOperator {
  DenseOperator::Storage storage;
  std::vector<std::vector<float>> plain;  // [matrix][n][n]

  RandomOperator(std::size_t n, std::uint32_t matrix_count, std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    storage.matrix_count = matrix_count;
    storage.channel_matrix = {0, matrix_count > 1 ? 1U : 0U, matrix_count - 1};
    for (std::size_t i = 0; i < n; ++i) storage.area.push_back(0.1F + uniform(engine));
    std::vector<float> tiles(matrix_count * DenseOperator::tile_count(n) * kTile * kTile, 0.0F);
    for (std::uint32_t m = 0; m < matrix_count; ++m) {
      auto& matrix = plain.emplace_back(n * n);
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
          matrix[i * n + j] = matrix[j * n + i] = uniform(engine) / static_cast<float>(n);
        }
      }
      fill_tiles(matrix, n, &tiles[m * DenseOperator::tile_count(n) * kTile * kTile]);
    }
    storage.tiles_f32 = SharedArray(std::move(tiles));
  }

  static void fill_tiles(const std::vector<float>& matrix, std::size_t n, float* tile) {
    const std::size_t side = (n + kTile - 1) / kTile;
    for (std::size_t row = 0; row < side; ++row) {
      for (std::size_t column = 0; column <= row; ++column, tile += kTile * kTile) {
        for (std::size_t r = 0; r < kTile; ++r) {
          for (std::size_t c = 0; c < kTile; ++c) {
            const std::size_t i = row * kTile + r, j = column * kTile + c;
            if (i < n && j < n) tile[r * kTile + c] = matrix[i * n + j];
          }
        }
      }
    }
  }

  std::vector<Float3> multiply(const std::vector<Float3>& m0) const {
    const std::size_t n = m0.size();
    std::vector<Float3> h(n);
    for (int c = 0; c < kChannelCount; ++c) {
      const std::vector<float>& y = plain[storage.channel_matrix[c]];
      for (std::size_t i = 0; i < n; ++i) {
        double sum = 0;
        for (std::size_t j = 0; j < n; ++j) {
          sum += static_cast<double>(y[i * n + j]) * std::sqrt(storage.area[j]) * m0[j][c];
        }
        h[i][c] = static_cast<float>(sum / std::sqrt(storage.area[i]));
      }
    }
    return h;
  }
};

std::vector<Float3> apply(const DenseOperator& op, const std::vector<Float3>& m0) {
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.workspace_size(), std::nanf(""));
  op.apply(m0, h, workspace);
  return h;
}

TEST(DenseOperator, MultipliesLikeThePlainMatrix) {
  for (const std::size_t n : {1U, 63U, 64U, 65U, 300U, 1000U}) {
    for (const std::uint32_t matrices : {1U, 2U, 3U}) {
      const RandomOperator random(n, matrices, 7 * n + matrices);
      const DenseOperator op(random.storage);
      const std::vector<Float3> m0 = test::random_light(n, n, 100);
      EXPECT_LT(relative_difference(apply(op, m0), random.multiply(m0), random.storage.area), 1e-6)
          << n << " patches, " << matrices << " matrices";
    }
  }
}

TEST(DenseOperator, HalfPrecisionIsAsGoodAsItsBits) {
  const RandomOperator random(500, 3, 5);
  DenseOperator::Storage half = random.storage;
  half.precision = Precision::kF16;
  half.tiles_f16 = SharedArray(DenseOperator::encode_half(random.storage.tiles_f32.span()));
  half.tiles_f32 = {};
  const DenseOperator op(half), exact(random.storage);
  EXPECT_EQ(2 * op.bytes(), exact.bytes());
  const std::vector<Float3> m0 = test::random_light(500, 1, 100);
  const double error = relative_difference(apply(op, m0), random.multiply(m0), half.area);
  EXPECT_LT(error, 5e-4);  // 11 bits per entry, and errors of many entries cancel
  EXPECT_GT(error, 0);
}

TEST(DenseOperator, SameBitsForAnyNumberOfThreads) {
  const RandomOperator random(777, 3, 6);
  const DenseOperator op(random.storage);
  const std::vector<Float3> m0 = test::random_light(777, 2, 100);
  const auto make = [&] { return apply(op, m0); };
  const std::vector<Float3> one = test::with_threads(1, make), five = test::with_threads(5, make);
  EXPECT_EQ(one, five);
}

TEST(DenseOperator, ExpandsToYItself) {
  const RandomOperator random(70, 2, 9);
  const DenseOperator op(random.storage);
  std::vector<float> y(70 * 70);
  op.expand(2, y);
  const std::vector<float>& symmetric = random.plain[1];
  const std::vector<float>& area = random.storage.area;
  for (std::size_t i = 0; i < 70; ++i) {
    for (std::size_t j = 0; j < 70; ++j) {
      EXPECT_FLOAT_EQ(y[i * 70 + j], symmetric[i * 70 + j] * std::sqrt(area[j] / area[i]));
    }
  }
}

TEST(DenseOperator, RefusesStorageThatDoesNotFit) {
  DenseOperator::Storage storage = RandomOperator(100, 1, 1).storage;
  storage.area.resize(200, 1.0F);
  EXPECT_THROW(DenseOperator{storage}, Error);
  storage = RandomOperator(100, 1, 1).storage;
  storage.channel_matrix[1] = 3;
  EXPECT_THROW(DenseOperator{storage}, Error);
  storage = RandomOperator(100, 1, 1).storage;
  std::vector<float> tiles(storage.tiles_f32.begin(), storage.tiles_f32.end());
  tiles[5] = std::numeric_limits<float>::infinity();
  storage.tiles_f32 = SharedArray(std::move(tiles));
  EXPECT_THROW(DenseOperator{storage}, Error);
  const std::vector<float> huge(64 * 64, 100.0F);
  EXPECT_THROW(DenseOperator::encode_half(huge), Error);
}

/// One tile product by each instruction set that this processor has, against plain double sums.
void check_kernels(const DenseKernels& kernels) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<float> tile(kTile * kTile), x_row(kTile), x_column(kTile);
  for (auto* values : {&tile, &x_row, &x_column}) {
    for (float& v : *values) v = uniform(engine);
  }
  std::vector<std::uint16_t> half(tile.size());
  std::ranges::transform(tile, half.begin(), float_to_half);
  std::vector<float> y_row(kTile, 1), y_column(kTile, 2), half_row(kTile, 1), half_column(kTile, 2);
  std::vector<float> diagonal(kTile, 3);
  kernels.f32.off_diagonal(tile.data(), x_column.data(), x_row.data(), y_row.data(),
                           y_column.data());
  kernels.f16.off_diagonal(half.data(), x_column.data(), x_row.data(), half_row.data(),
                           half_column.data());
  kernels.f32.diagonal(tile.data(), x_column.data(), diagonal.data());
  for (std::size_t k = 0; k < kTile; ++k) {
    double row = 0, column = 0;
    for (std::size_t l = 0; l < kTile; ++l) {
      row += static_cast<double>(tile[k * kTile + l]) * x_column[l];
      column += static_cast<double>(tile[l * kTile + k]) * x_row[l];
    }
    EXPECT_NEAR(y_row[k], 1 + row, 1e-5);
    EXPECT_NEAR(y_column[k], 2 + column, 1e-5);
    EXPECT_NEAR(diagonal[k], 3 + row, 1e-5);
    EXPECT_NEAR(half_row[k], 1 + row, 1e-2);
    EXPECT_NEAR(half_column[k], 2 + column, 1e-2);
  }
}

TEST(DenseKernels, EveryInstructionSetAgrees) {
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    check_kernels(set->dense);
  }
}

TEST(HalfFloat, ConvertsThereAndBack) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    const float value = half_to_float(half);
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(half_to_float(float_to_half(value))));
    } else {
      EXPECT_EQ(float_to_half(value), half) << value;
    }
  }
  EXPECT_EQ(half_to_float(float_to_half(65504.0F)), 65504.0F);
  EXPECT_TRUE(std::isinf(half_to_float(float_to_half(65520.0F))));
  EXPECT_EQ(half_to_float(float_to_half(1.0F + 0x1p-12F)), 1.0F);  // below half a step
}

TEST(DenseOperator, PlanesAreTheChannelsOfLights) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    const DenseOperator dense(RandomOperator(150, matrices, 20 + matrices).storage);
    for (const std::size_t lights : {1U, 4U}) test::check_planes(dense, lights, 1e-6F);
  }
}

TEST(DenseOperator, WrongPlanesAreRefused) {
  constexpr std::size_t kPatches = 70;
  const DenseOperator dense(RandomOperator(kPatches, 1, 3).storage);
  std::vector<float> in(6 * kPatches), out(6 * kPatches), workspace(dense.workspace_size());
  const auto apply = [&](std::optional<int> channel, std::size_t from, std::size_t to) {
    dense.apply_planes(channel, std::span(in).first(from), std::span(out).first(to), workspace);
  };
  EXPECT_NO_THROW(apply({}, 6 * kPatches, 6 * kPatches));
  EXPECT_NO_THROW(apply(2, 2 * kPatches, 2 * kPatches));
  EXPECT_NO_THROW(apply({}, 0, 0));
  EXPECT_THROW(apply({}, 2 * kPatches, 2 * kPatches), Error);
  EXPECT_THROW(apply(1, kPatches + 1, kPatches + 1), Error);
  EXPECT_THROW(apply(1, kPatches, 2 * kPatches), Error);
  test::expect_error([&] { apply(3, kPatches, kPatches); }, "channel 3");
}

TEST(DenseOperator, WrongSizesAreRefused) {
  constexpr std::size_t kPatches = 70;
  const DenseOperator dense(RandomOperator(kPatches, 1, 3).storage);
  std::vector<Float3> in(2 * kPatches + 1), out(2 * kPatches + 1);
  std::vector<float> workspace(dense.batch_workspace_size(2)), matrix(kPatches * kPatches);
  const auto apply = [&](std::size_t from, std::size_t to, std::size_t floats) {
    dense.apply(std::span(in).first(from), std::span(out).first(to),
                std::span(workspace).first(floats));
  };
  const std::size_t enough = dense.workspace_size();
  EXPECT_NO_THROW(apply(kPatches, kPatches, enough));
  EXPECT_THROW(apply(kPatches - 1, kPatches, enough), Error);
  EXPECT_THROW(apply(kPatches, kPatches + 1, enough), Error);
  test::expect_error([&] { apply(kPatches, kPatches, enough - 1); }, "workspace");
  const auto both = [&](std::size_t size) {
    dense.apply_batch(2, std::span(in).first(size), std::span(out).first(size), workspace);
  };
  EXPECT_NO_THROW(both(2 * kPatches));
  EXPECT_THROW(both(2 * kPatches + 1), Error);
  EXPECT_NO_THROW(dense.expand(2, matrix));
  EXPECT_THROW(dense.expand(3, matrix), Error);
  EXPECT_THROW(dense.expand(0, std::span(matrix).first(kPatches)), Error);
}

}  // namespace
}  // namespace rebounce::test_dense_operator

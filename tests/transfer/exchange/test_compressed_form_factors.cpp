// Compressed F against the dense matrix that it stands for.

#include "transfer/exchange/compressed_form_factors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rebounce/error.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/random_light.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce::test_compressed_form_factors {
namespace {

/// A random matrix of blocks of all kinds, and a system with it that converges: its reflectances
/// are below the inverse of the largest row sum.
struct System {
  std::shared_ptr<const HierarchicalOperator> exchange;
  std::vector<float> matrix;  ///< F, [n][n]
  std::vector<Float3> reflectance, light;

  System(std::size_t n, std::uint64_t seed, Precision precision, bool equilibrated = false) {
    HierarchicalStorage storage = test::random_hierarchical_storage(n, 1, seed);
    if (equilibrated) storage = test::equilibrated(std::move(storage), seed);
    storage = encode_values(storage, precision);
    exchange = std::make_shared<const HierarchicalOperator>(std::move(storage));
    matrix.resize(n * n);
    exchange->expand(0, matrix);
    float largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      float sum = 0;
      for (std::size_t j = 0; j < n; ++j) sum += std::abs(matrix[i * n + j]);
      largest = std::max(largest, sum);
    }
    for (const Float3& x : test::random_light(n, seed + 1)) {
      reflectance.push_back({0.9F * x[0] / largest, 0.9F * x[1] / largest, 0});
    }
    light = test::random_light(n, seed + 2);
  }

  const std::vector<float>& area() const { return exchange->storage().area; }
  RelaxationProblem problem() const { return {area(), reflectance, light}; }

  /// The sweeps in double precision, position after position; inside of diagonal blocks of low rank
  /// with the values before.
  void sweep(std::vector<std::array<double, 3>>& b, SweepDirection direction) const {
    std::vector<TransferBlock> diagonal;
    for (const TransferBlock& block : exchange->storage().blocks) {
      if (block.on_diagonal()) diagonal.push_back(block);
    }
    std::ranges::sort(diagonal, {}, &TransferBlock::row_begin);
    const bool forward = direction == SweepDirection::kForward;
    if (!forward) std::ranges::reverse(diagonal);
    for (const TransferBlock& block : diagonal) {
      const auto before = b;
      for (std::uint32_t k = 0; k < block.row_count; ++k) {
        const std::uint32_t at = block.row_begin + (forward ? k : block.row_count - 1 - k);
        if (at < light.size()) relax(b, block, before, at);
      }
    }
  }

 private:
  void relax(std::vector<std::array<double, 3>>& b, const TransferBlock& block,
             const std::vector<std::array<double, 3>>& before, std::size_t at) const {
    const std::vector<std::uint32_t>& patch = exchange->storage().patch;
    const std::size_t n = light.size(), i = patch[at];
    for (int c = 0; c < kChannelCount; ++c) {
      double sum = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const bool inside = k >= block.row_begin && k < block.row_begin + block.row_count;
        const bool lagged = inside && block.kind == TransferBlock::Kind::kLowRank;
        sum += matrix[i * n + patch[k]] * (lagged ? before : b)[patch[k]][c];
      }
      b[i][c] = light[i][c] + reflectance[i][c] * sum;
    }
  }
};

double difference(std::span<const Float3> a, const std::vector<std::array<double, 3>>& b) {
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      error += std::pow(a[i][c] - b[i][c], 2);
      norm += b[i][c] * b[i][c];
    }
  }
  return std::sqrt(error / norm);
}

TEST(CompressedFormFactors, GatherIsTheMatrix) {
  const System system(333, 1, Precision::kF32);
  const CompressedFormFactors form_factors(system.exchange);
  const std::vector<Float3> gathered = gather(form_factors, system.light);
  std::vector<std::array<double, 3>> expected(333, {0, 0, 0});
  for (std::size_t i = 0; i < 333; ++i) {
    for (std::size_t j = 0; j < 333; ++j) {
      for (int c = 0; c < 3; ++c) expected[i][c] += system.matrix[i * 333 + j] * system.light[j][c];
    }
  }
  EXPECT_LE(difference(gathered, expected), 1e-6);
}

/// Sweeps in every order of directions against those in double precision.
void check_sweeps(const System& system, std::uint64_t seed, double tolerance) {
  constexpr auto kForward = SweepDirection::kForward, kBackward = SweepDirection::kBackward;
  const std::size_t n = system.light.size();
  const CompressedFormFactors form_factors(system.exchange);
  const auto relaxation = form_factors.make_relaxation();
  const std::vector<Float3> start = test::random_light(n, seed + 7);
  std::vector<std::array<double, 3>> expected;
  for (const Float3& x : start) expected.push_back({x[0], x[1], x[2]});
  relaxation->begin(system.problem(), start);
  std::vector<Float3> radiosity(n);
  for (const SweepDirection direction :
       {kForward, kForward, kBackward, kForward, kForward, kBackward, kBackward}) {
    relaxation->sweep(direction);
    relaxation->end(radiosity);
    system.sweep(expected, direction);
    EXPECT_LE(difference(radiosity, expected), tolerance);
  }
}

TEST(CompressedFormFactors, SweepsAreGaussSeidelInEveryOrderOfDirections) {
  int low_rank_on_diagonal = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    for (const Precision precision : {Precision::kF32, Precision::kF16, Precision::kQ8}) {
      // Products of integers round the light.
      const double tolerance = precision == Precision::kQ8 ? 1e-4 : 1e-6;
      for (const bool equilibrated : {false, true}) {
        SCOPED_TRACE("seed " + std::to_string(seed) + ", " + precision_name(precision) +
                     (equilibrated ? ", equilibrated" : ""));
        const System system(421, seed, precision, equilibrated);
        for (const TransferBlock& block : system.exchange->storage().blocks) {
          low_rank_on_diagonal += block.on_diagonal() && block.row_rank > 0 ? 1 : 0;
        }
        check_sweeps(system, seed, tolerance);
      }
    }
  }
  EXPECT_GT(low_rank_on_diagonal, 0);
}

/// Of radiosities [n], the sum of squares of A^1/2 B.
double squared_change(const System& system, std::span<const Float3> before,
                      std::span<const Float3> after) {
  double changed = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      changed += system.area()[i] * std::pow(static_cast<double>(after[i][c]) - before[i][c], 2);
    }
  }
  return changed;
}

TEST(CompressedFormFactors, ASweepReportsWhatItChanged) {
  for (const bool equilibrated : {false, true}) {
    const System system(200, 5, Precision::kF32, equilibrated);
    const auto relaxation = CompressedFormFactors(system.exchange).make_relaxation();
    std::vector<Float3> before = test::random_light(200, 6), after(200);
    relaxation->begin(system.problem(), before);
    for (const auto direction : {SweepDirection::kForward, SweepDirection::kBackward}) {
      const double reported = relaxation->sweep(direction);
      relaxation->end(after);
      const double changed = squared_change(system, before, after);
      EXPECT_NEAR(reported, changed, 1e-3 * changed);
      before = after;
    }
  }
}

TEST(CompressedFormFactors, SweepsDoNotAllocate) {
  const System system(200, 5, Precision::kF16);
  const auto relaxation = CompressedFormFactors(system.exchange).make_relaxation();
  std::vector<Float3> radiosity(200, {0, 0, 0});
  const int count = test::count_allocations([&] {
    relaxation->begin(system.problem(), radiosity);
    relaxation->sweep(SweepDirection::kForward);
    relaxation->sweep(SweepDirection::kBackward);
    relaxation->end(radiosity);
  });
  EXPECT_EQ(count, 0);
}

TEST(CompressedFormFactors, RefusesNothingAndChannelsOfTheirOwn) {
  EXPECT_THROW(CompressedFormFactors(nullptr), Error);
  EXPECT_THROW(CompressedFormFactors(std::make_shared<const HierarchicalOperator>(
                   test::random_hierarchical_storage(100, 3, 1))),
               Error);
}

}  // namespace
}  // namespace rebounce::test_compressed_form_factors

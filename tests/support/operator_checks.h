#pragma once

// Products of an operator, and what they must agree with.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "rebounce/error.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/expect_error.h"
#include "tests/support/random_light.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test {

inline constexpr Precision kPrecisions[] = {Precision::kF32, Precision::kF16, Precision::kQ8};

/// Y M0, into an array that holds something else and with a workspace that holds no numbers.
inline std::vector<Float3> unaided_product(const TransferOperator& op,
                                           const std::vector<Float3>& m0) {
  std::vector<Float3> h(m0.size(), Float3{-1, -2, -3});
  std::vector<float> workspace(op.workspace_size(), std::nanf(""));
  op.apply(m0, h, workspace);
  return h;
}

/// Y M0 by plain sums in double precision over the operator's own expansion.
inline std::vector<Float3> multiply_expansion(const TransferOperator& op,
                                              const std::vector<Float3>& m0) {
  const std::size_t n = m0.size();
  std::vector<float> y(n * n);
  std::vector<Float3> h(n);
  for (int c = 0; c < kChannelCount; ++c) {
    op.expand(c, y);
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j) sum += static_cast<double>(y[i * n + j]) * m0[j][c];
      h[i][c] = static_cast<float>(sum);
    }
  }
  return h;
}

/// A batch gives each of its lights what an apply gives it, but for the order of sums.
inline void check_batch(const HierarchicalOperator& op, std::size_t lights) {
  const std::size_t n = op.patch_count();
  const std::vector<Float3> m0 = random_light(lights * n, lights, 100);
  std::vector<Float3> batch(m0.size(), Float3{-1, -2, -3});
  std::vector<float> workspace(op.batch_workspace_size(lights), std::nanf(""));
  op.apply_batch(lights, m0, batch, workspace);
  for (std::size_t light = 0; light < lights; ++light) {
    const auto at = static_cast<std::ptrdiff_t>(light * n);
    const auto end = at + static_cast<std::ptrdiff_t>(n);
    const std::vector<Float3> one(m0.begin() + at, m0.begin() + end);
    const std::vector<Float3> part(batch.begin() + at, batch.begin() + end);
    EXPECT_LT(relative_difference(part, unaided_product(op, one), op.storage().area), 1e-6);
  }
}

/// Plane `channel` of [lights][3][n], or all of them, in the order of the lights.
inline std::vector<float> planes_of(const std::vector<Float3>& light, std::size_t n,
                                    std::optional<int> channel) {
  std::vector<float> planes;
  for (std::size_t at = 0; at < light.size(); at += n) {
    for (int c = channel.value_or(0); c < (channel ? *channel + 1 : kChannelCount); ++c) {
      for (std::size_t i = 0; i < n; ++i) planes.push_back(light[at + i][c]);
    }
  }
  return planes;
}

/// Planes of light, of all channels and of each alone, get what applies give their lights, but for
/// rounding: `allowed` of the largest.
inline void check_planes(const TransferOperator& op, std::size_t lights, float allowed) {
  const std::size_t n = op.patch_count();
  const std::vector<Float3> m0 = random_light(lights * n, lights, 100);
  std::vector<Float3> applied;
  for (std::size_t light = 0; light < lights; ++light) {
    const auto first = m0.begin() + static_cast<std::ptrdiff_t>(light * n);
    const std::vector<Float3> h =
        unaided_product(op, {first, first + static_cast<std::ptrdiff_t>(n)});
    applied.insert(applied.end(), h.begin(), h.end());
  }
  for (const std::optional<int> channel : {std::optional<int>(), {0}, {1}, {2}}) {
    const std::vector<float> in = planes_of(m0, n, channel),
                             wanted = planes_of(applied, n, channel);
    std::vector<float> out(in.size(), -1);
    std::vector<float> workspace(op.batch_workspace_size(lights), std::nanf(""));
    op.apply_planes(channel, in, out, workspace);
    const float most = std::abs(
        *std::ranges::max_element(wanted, {}, [](float value) { return std::abs(value); }));
    for (std::size_t k = 0; k < out.size(); ++k) {
      ASSERT_NEAR(out[k], wanted[k], allowed * most) << "channel " << channel.value_or(-1);
    }
  }
}

/// Light at the receivers differs by `allowed` of the largest at most.
inline void check_receivers(const HierarchicalOperator& op, float allowed) {
  const std::size_t n = op.patch_count();
  const std::vector<Float3> m0 = random_light(n, 4, 100), whole = unaided_product(op, m0);
  float most = 0;
  for (const Float3& h : whole)
    most = std::max({most, std::abs(h[0]), std::abs(h[1]), std::abs(h[2])});
  std::vector<float> workspace(op.workspace_size(), std::nanf(""));
  constexpr Float3 kUnset = {-1, -2, -3};
  std::uint64_t previous = 0;
  for (const std::size_t count : {0U, 1U, 40U, 400U, 777U}) {
    // Neighbours in the order of the clusters, like the patches of a room.
    const std::vector<std::uint32_t> patches(
        op.storage().patch.begin() + static_cast<std::ptrdiff_t>((n - count) / 2),
        op.storage().patch.begin() + static_cast<std::ptrdiff_t>((n - count) / 2 + count));
    const HierarchicalOperator::Receivers receivers = op.receivers(patches);
    std::vector<Float3> h(n, kUnset);
    op.apply_to(receivers, m0, h, workspace);
    EXPECT_THROW(op.apply_to(receivers, m0, h, std::span(workspace).subspan(1)), Error);
    EXPECT_THROW(op.apply_to(receivers, m0, std::span(h).subspan(1), workspace), Error);
    std::vector<Float3> expected(n, kUnset);
    for (const std::uint32_t p : patches) expected[p] = whole[p];
    for (std::size_t i = 0; i < n; ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        const bool untouched = expected[i] == kUnset;
        EXPECT_NEAR(h[i][c], expected[i][c], untouched ? 0 : allowed * most);
      }
    }
    EXPECT_TRUE(receivers.value_count() > previous || count == 0);
    previous = receivers.value_count();
  }
  EXPECT_EQ(op.receivers(std::vector<std::uint32_t>{}).value_count(), 0U);
  expect_error(
      [&] { (void)op.receivers(std::vector<std::uint32_t>{static_cast<std::uint32_t>(n)}); },
      "does not exist");
}

inline void expect_same_bits_for_any_number_of_threads(const TransferOperator& op) {
  const std::vector<Float3> m0 = random_light(op.patch_count(), 2, 100);
  const auto multiply = [&] { return unaided_product(op, m0); };
  EXPECT_EQ(with_threads(1, multiply), with_threads(5, multiply));
}

inline void expect_no_allocations(const HierarchicalOperator& op) {
  const std::vector<Float3> m0 = random_light(op.patch_count(), 3, 100);
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.workspace_size());
  const HierarchicalOperator::Receivers receivers = op.receivers(std::vector<std::uint32_t>{1, 7});
  EXPECT_EQ(count_allocations([&] { op.apply(m0, h, workspace); }), 0);
  EXPECT_EQ(count_allocations([&] { op.apply_to(receivers, m0, h, workspace); }), 0);
  EXPECT_GT(count_allocations([&] { h.reserve(2 * h.size()); }), 0) << "allocations are counted";
}

}  // namespace rebounce::test

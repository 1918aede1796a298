#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "transfer/exchange/exchange_matrix.h"

namespace rebounce::test {

/// Patches of which each pair sees each other by chance, in runs of random length.
struct Pairs {
  std::vector<float> area;
  ExchangeMatrix exchange;
  std::vector<Float3> light;

  explicit Pairs(std::size_t n) {
    std::mt19937_64 engine(n);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<std::uint64_t> begin = {0};
    std::vector<std::uint32_t> column;
    std::vector<float> value;
    for (std::size_t i = 0; i < n; ++i) {
      area.push_back(0.5F + uniform(engine));
      light.push_back({uniform(engine), 100 * uniform(engine), uniform(engine) - 0.5F});
      bool seen = false;
      for (std::size_t j = i + 1; j < n; ++j) {
        if (uniform(engine) < 0.1F) seen = !seen;
        if (!seen) continue;
        column.push_back(static_cast<std::uint32_t>(j));
        value.push_back(uniform(engine) / static_cast<float>(n));
      }
      begin.push_back(column.size());
    }
    exchange = {SharedArray(std::move(begin)), SharedArray(std::move(column)),
                SharedArray(std::move(value))};
  }
};

/// Fails the test where a component is off by more than a part of it, or of 1 where it is less.
inline void expect_near_relative(const Float3& a, const Float3& b, double tolerance) {
  for (int c = 0; c < kChannelCount; ++c) EXPECT_NEAR(a[c], b[c], tolerance * (1 + std::abs(b[c])));
}

}  // namespace rebounce::test

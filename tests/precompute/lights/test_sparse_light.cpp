// Lights that are kept without the patches where they are zero.
#include "precompute/lights/sparse_light.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace rebounce {
namespace {

using Exitance = std::vector<Float3>;

TEST(SparseLight, HasTheValuesThatItWasMadeOf) {
  constexpr Float3 kDark{0, 0, 0}, kRed{1, 0, 0}, kBlue{0, 0, -2.5F}, kWhite{3, 3, 3};
  const std::vector<Exitance> lights{
      {},
      {kDark},
      {kWhite},
      {kDark, kDark, kDark},
      {kRed, kBlue, kWhite},
      {kDark, kRed, kDark, kBlue, kWhite, kDark, kDark, kRed},
      {kRed, kDark, kDark, kBlue},
  };
  for (const Exitance& light : lights) {
    EXPECT_EQ(SparseLight(light).expanded(), light);
  }
  EXPECT_EQ(expanded(sparse_lights(lights)), lights);
}

TEST(SparseLight, HasTheValuesOfRandomLights) {
  constexpr unsigned kSeed = 172;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  for (const double lit : {0.01, 0.5, 0.99}) {
    std::bernoulli_distribution is_lit(lit);
    Exitance light(1000);
    for (Float3& value : light) {
      if (is_lit(random)) value = {0, static_cast<float>(random() % 100), 1e-30F};
    }
    EXPECT_EQ(SparseLight(light).expanded(), light);
  }
}

}  // namespace
}  // namespace rebounce

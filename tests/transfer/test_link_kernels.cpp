#include "../../transfer/link_kernels.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "../../transfer/bfloat16.h"

namespace rebounce {
namespace {

TEST(Bfloat16, IsTheNearest) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> exponent(-30, 30), part(-1, 1);
  for (int k = 0; k < 10000; ++k) {
    const float value = part(engine) * std::exp2(exponent(engine));
    const std::uint16_t bits = float_to_bfloat16(value);
    const float error = std::abs(bfloat16_to_float(bits) - value);
    EXPECT_LE(error, std::abs(value) * 0x1p-8F);
    for (const int step : {-1, 1}) {
      const auto other = bfloat16_to_float(static_cast<std::uint16_t>(bits + step));
      EXPECT_LE(error, std::abs(other - value)) << value;
    }
  }
  EXPECT_EQ(bfloat16_to_float(float_to_bfloat16(0)), 0);
  EXPECT_EQ(bfloat16_to_float(float_to_bfloat16(-1.5F)), -1.5F);
}

TEST(LinkKernels, AgreeWithEachOther) {
  std::mt19937 engine(2);
  std::uniform_real_distribution<float> value(-1, 1);
  std::vector<LinkLight> light(50);
  for (LinkLight& l : light) {
    for (float& x : l.mean) x = value(engine);
    for (ColorLanes& first : l.first) {
      for (float& x : first) x = value(engine);
    }
  }
  std::vector<IncomingLink> links(200);
  for (IncomingLink& link : links) {
    link.from = static_cast<std::uint32_t>(engine() % light.size());
    link.exchange_area = std::abs(value(engine));
    for (std::uint16_t& g : link.gradient_from) g = float_to_bfloat16(value(engine));
    for (std::uint16_t& g : link.gradient_to) g = float_to_bfloat16(value(engine));
  }
  for (const std::size_t count : {0UL, 1UL, 200UL}) {
    const LinkLight wanted = kLinkKernelsPortable.gather(links.data(), count, light.data());
    for (const LinkKernels* kernels : link_kernel_sets()) {
      const auto found =
          std::bit_cast<std::array<float, 16>>(kernels->gather(links.data(), count, light.data()));
      const auto expected = std::bit_cast<std::array<float, 16>>(wanted);
      for (std::size_t k = 0; k < found.size(); ++k) {
        EXPECT_NEAR(found[k], expected[k], 1e-4) << kernels->instruction_set << " " << k;
      }
    }
  }
}

}  // namespace
}  // namespace rebounce

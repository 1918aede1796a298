#include "transfer/kernels/kernels.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "transfer/base/bfloat16.h"

namespace rebounce::test_link_kernels {
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

template <typename Lanes>
std::vector<LinkLightOf<Lanes>> random_light(std::size_t count, std::mt19937& engine) {
  std::uniform_real_distribution<float> value(-1, 1);
  std::vector<LinkLightOf<Lanes>> light(count);
  for (LinkLightOf<Lanes>& l : light) {
    for (auto& x : l.mean) x = value(engine);
    for (Lanes& first : l.first) {
      for (auto& x : first) x = value(engine);
    }
  }
  return light;
}

std::vector<IncomingLink> random_links(std::size_t count, std::size_t node_count,
                                       std::mt19937& engine) {
  std::uniform_real_distribution<float> value(-1, 1);
  std::vector<IncomingLink> links(count);
  for (IncomingLink& link : links) {
    link.from = static_cast<std::uint32_t>(engine() % node_count);
    link.exchange_area = std::abs(value(engine));
    for (std::uint16_t& g : link.gradient_from) g = float_to_bfloat16(value(engine));
    for (std::uint16_t& g : link.gradient_to) g = float_to_bfloat16(value(engine));
  }
  return links;
}

TEST(LinkKernels, AgreeWithEachOther) {
  std::mt19937 engine(2);
  const auto light = random_light<ColorLanes>(50, engine);
  const std::vector<IncomingLink> links = random_links(200, light.size(), engine);
  for (const std::size_t count : {0UL, 1UL, 200UL}) {
    const LinkLight wanted = kKernelsPortable.link.gather(links.data(), count, light.data());
    for (const KernelSet* set : kernel_sets()) {
      const auto found =
          std::bit_cast<std::array<float, 16>>(set->link.gather(links.data(), count, light.data()));
      const auto expected = std::bit_cast<std::array<float, 16>>(wanted);
      for (std::size_t k = 0; k < found.size(); ++k) {
        EXPECT_NEAR(found[k], expected[k], 1e-4) << set->instruction_set << " " << k;
      }
    }
  }
}

TEST(LinkKernels, GiveTheSameBitsForManyLights) {
  std::mt19937 engine(3);
  const auto floats = random_light<ManyFloats>(50, engine);
  const auto doubles = random_light<ManyDoubles>(50, engine);
  const std::vector<IncomingLink> links = random_links(200, floats.size(), engine);
  for (const std::size_t count : {0UL, 1UL, 200UL}) {
    const auto wanted = kKernelsPortable.link.gather_floats(links.data(), count, floats.data());
    const auto exact = kKernelsPortable.link.gather_doubles(links.data(), count, doubles.data());
    for (const KernelSet* set : kernel_sets()) {
      SCOPED_TRACE(set->instruction_set);
      const auto found = set->link.gather_floats(links.data(), count, floats.data());
      EXPECT_EQ(found.mean, wanted.mean);
      EXPECT_EQ(found.first, wanted.first);
      const auto found_exact = set->link.gather_doubles(links.data(), count, doubles.data());
      EXPECT_EQ(found_exact.mean, exact.mean);
      EXPECT_EQ(found_exact.first, exact.first);
    }
  }
}

}  // namespace
}  // namespace rebounce::test_link_kernels

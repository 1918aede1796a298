#include "transfer/kernels/kernels.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <random>
#include <utility>
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

/// The light of `count` nodes.
template <typename Lanes>
class RandomLight {
 public:
  RandomLight(std::size_t count, std::mt19937& engine) : memory_(count) {
    std::uniform_real_distribution<float> value(-1, 1);
    for (std::size_t node = 0; node < count; ++node) {
      for (auto& x : nodes().mean_of(node)) x = value(engine);
      for (Lanes& first : nodes().first_of(node)) {
        for (auto& x : first) x = value(engine);
      }
    }
  }

  std::size_t size() const { return memory_.size(); }
  NodeLights<Lanes> nodes() { return {memory_.data(), memory_.size()}; }

 private:
  std::vector<LinkLightOf<Lanes>> memory_;
};

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

/// Those with gradients, or all without.
struct RandomLinks {
  std::vector<IncomingLink> affine;
  std::vector<PlainLink> plain;

  RandomLinks(std::size_t count, std::size_t node_count, std::mt19937& engine)
      : affine(random_links(count, node_count, engine)) {
    for (const IncomingLink& link : random_links(count, node_count, engine)) {
      plain.push_back({link.from, link.exchange_area});
    }
  }

  LinksOfNode first(std::size_t plain_count, std::size_t affine_count) const {
    return {plain.data(), plain_count, affine.data(), affine_count};
  }
};

constexpr std::array<std::pair<std::size_t, std::size_t>, 5> kCounts = {
    {{0, 0}, {1, 0}, {0, 1}, {7, 200}, {200, 3}}};

TEST(LinkKernels, AgreeWithEachOther) {
  std::mt19937 engine(2);
  RandomLight<ColorLanes> light(50, engine);
  const RandomLinks links(200, light.size(), engine);
  for (const auto& [plain, affine] : kCounts) {
    const LinksOfNode some = links.first(plain, affine);
    const LinkLight wanted = kKernelsPortable.link.gather(some, light.nodes());
    for (const KernelSet* set : kernel_sets()) {
      const auto found =
          std::bit_cast<std::array<float, 16>>(set->link.gather(some, light.nodes()));
      const auto expected = std::bit_cast<std::array<float, 16>>(wanted);
      for (std::size_t k = 0; k < found.size(); ++k) {
        EXPECT_NEAR(found[k], expected[k], 1e-4) << set->instruction_set << " " << k;
      }
    }
  }
}

TEST(LinkKernels, GiveTheSameBitsForManyLights) {
  std::mt19937 engine(3);
  RandomLight<ManyFloats> floats(50, engine);
  RandomLight<ManyDoubles> doubles(50, engine);
  const RandomLinks links(200, floats.size(), engine);
  for (const auto& [plain, affine] : kCounts) {
    const LinksOfNode some = links.first(plain, affine);
    const auto wanted = kKernelsPortable.link.gather_floats(some, floats.nodes());
    const auto exact = kKernelsPortable.link.gather_doubles(some, doubles.nodes());
    for (const KernelSet* set : kernel_sets()) {
      SCOPED_TRACE(set->instruction_set);
      const auto found = set->link.gather_floats(some, floats.nodes());
      EXPECT_EQ(found.mean, wanted.mean);
      EXPECT_EQ(found.first, wanted.first);
      const auto found_exact = set->link.gather_doubles(some, doubles.nodes());
      EXPECT_EQ(found_exact.mean, exact.mean);
      EXPECT_EQ(found_exact.first, exact.first);
    }
  }
}

TEST(LinkKernels, PlainLinksAreLinksWhoseGradientsAreZero) {
  std::mt19937 engine(4);
  RandomLight<ManyDoubles> light(50, engine);
  const RandomLinks links(200, light.size(), engine);
  std::vector<IncomingLink> same;
  for (const PlainLink& link : links.plain) same.push_back(affine(link));
  const auto plain = kKernelsPortable.link.gather_doubles(links.first(200, 0), light.nodes());
  const auto other =
      kKernelsPortable.link.gather_doubles({nullptr, 0, same.data(), same.size()}, light.nodes());
  EXPECT_EQ(plain.mean, other.mean);
  EXPECT_EQ(plain.first, other.first);
}

/// By the definition of LinkLightOf, in double precision.
TEST(LinkKernels, GatherMeansAndMoments) {
  std::mt19937 engine(5);
  RandomLight<ManyDoubles> light(50, engine);
  const RandomLinks links(100, light.size(), engine);
  const auto found = kKernelsPortable.link.gather_doubles(links.first(100, 100), light.nodes());
  for (std::size_t lane = 0; lane < found.mean.size(); ++lane) {
    double mean = 0;
    std::array<double, 3> first{};
    for (const PlainLink& link : links.plain) {
      mean += link.exchange_area * light.nodes().mean_of(link.from)[lane];
    }
    for (const IncomingLink& link : links.affine) {
      const double from = light.nodes().mean_of(link.from)[lane];
      mean += link.exchange_area * from;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        mean += bfloat16_to_float(link.gradient_from[axis]) *
                light.nodes().first_of(link.from)[axis][lane];
        first[axis] += bfloat16_to_float(link.gradient_to[axis]) * from;
      }
    }
    EXPECT_NEAR(found.mean[lane], mean, 1e-12);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(found.first[axis][lane], first[axis], 1e-12);
    }
  }
}

}  // namespace
}  // namespace rebounce::test_link_kernels

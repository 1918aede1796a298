#include "transfer/operator/receiver_products.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "tests/support/allocation_counter.h"
#include "tests/support/thread_pool.h"

namespace rebounce::test_receiver_products {
namespace {

constexpr std::size_t kPatches = 300, kGroups = 9;
constexpr std::uint32_t kGroup = ReceiverRows::kGroup;

struct Sample {
  ReceiverRows rows;
  std::vector<float> area;
  std::vector<Float3> radiosity, light;
};

Sample make_sample(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> number(0.1F, 2);
  std::uniform_int_distribution<int> byte(-127, 127);
  Sample sample;
  ReceiverRows& rows = sample.rows;
  rows.patch.resize(kPatches);
  std::iota(rows.patch.begin(), rows.patch.end(), 0U);
  std::ranges::shuffle(rows.patch, random);
  for (std::uint32_t k = 0; k < 100; ++k) {
    const auto begin = static_cast<std::uint32_t>(random() % kPatches);
    rows.set.push_back(
        {begin, begin + 1 + static_cast<std::uint32_t>(random() % (kPatches - begin))});
  }
  rows.group_begin = {0};
  rows.receiver.resize(kGroups * kGroup, kNone);
  std::vector<std::uint32_t> vertex(kGroups * kGroup);
  std::iota(vertex.begin(), vertex.end(), 0U);
  std::ranges::shuffle(vertex, random);
  for (std::uint32_t g = 0; g < kGroups; ++g) {
    const std::uint32_t sets = g == 3 ? 0 : 4 + random() % 60 * 4;
    for (std::uint32_t j = 0; j < sets; ++j) {
      rows.entry_set.push_back(static_cast<std::uint32_t>(random() % rows.set.size()));
      rows.scale.push_back(1e-4F * number(random));
    }
    rows.group_begin.push_back(static_cast<std::uint32_t>(rows.entry_set.size()));
    for (std::uint32_t i = 0; i < kGroup; ++i) {
      if (random() % 8 != 0) rows.receiver[g * kGroup + i] = vertex[g * kGroup + i];
    }
  }
  for (std::size_t k = 0; k < rows.entry_set.size() * kGroup; ++k) {
    rows.value.push_back(static_cast<std::int8_t>(byte(random)));
  }
  for (std::size_t i = 0; i < kPatches; ++i) {
    sample.area.push_back(number(random));
    sample.radiosity.push_back({number(random), 10 * number(random), 100 * number(random)});
  }
  sample.light.assign(kGroups * kGroup, Float3{1, 2, 3});
  return sample;
}

/// What is added to each vertex, as the format says.
std::vector<std::array<double, 3>> plain_sums(const Sample& sample) {
  const ReceiverRows& rows = sample.rows;
  std::vector<std::array<double, 3>> of_set;
  for (const auto& [begin, end] : rows.set) {
    std::array<double, 3> flux{};
    double area = 0;
    for (std::uint32_t k = begin; k < end; ++k) {
      const std::uint32_t i = rows.patch[k];
      area += sample.area[i];
      for (std::size_t c = 0; c < 3; ++c) {
        flux[c] += static_cast<double>(sample.area[i]) * sample.radiosity[i][c];
      }
    }
    for (double& f : flux) f /= area;
    of_set.push_back(flux);
  }
  std::vector<std::array<double, 3>> sum(sample.light.size());
  for (std::size_t g = 0; g < rows.group_count(); ++g) {
    for (std::uint32_t e = rows.group_begin[g]; e < rows.group_begin[g + 1]; ++e) {
      for (std::uint32_t i = 0; i < kGroup; ++i) {
        const std::uint32_t v = rows.receiver[g * kGroup + i];
        if (v == kNone) continue;
        const std::size_t at = std::size_t{kGroup} * rows.group_begin[g] +
                               ReceiverRows::value_index(e - rows.group_begin[g], i);
        const double part = static_cast<double>(rows.scale[e]) * rows.value[at];
        for (std::size_t c = 0; c < 3; ++c) sum[v][c] += part * of_set[rows.entry_set[e]][c];
      }
    }
  }
  return sum;
}

TEST(ReceiverProducts, AddWhatTheFormatSays) {
  constexpr std::uint32_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  Sample sample = make_sample(kSeed);
  const auto truth = plain_sums(sample);
  std::array<double, 3> largest{};
  for (const auto& t : truth) {
    for (std::size_t c = 0; c < 3; ++c) largest[c] = std::max(largest[c], std::abs(t[c]));
  }
  ReceiverProducts(sample.rows, sample.area).add(sample.radiosity, sample.light);
  int changed = 0;
  for (std::size_t v = 0; v < truth.size(); ++v) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(sample.light[v][c] - static_cast<float>(c + 1), truth[v][c], 1e-3 * largest[c]);
    }
    if (truth[v][0] != 0) ++changed;
  }
  EXPECT_GT(changed, 300);
}

TEST(ReceiverProducts, GiveTheSameBitsOnThreadsWithoutAllocating) {
  Sample sample = make_sample(5);
  ReceiverProducts products(sample.rows, sample.area);
  std::vector<Float3> once = sample.light, again = sample.light;
  EXPECT_EQ(test::count_allocations([&] { products.add(sample.radiosity, once); }), 0);
  test::ThreadPool pool(4);
  products.add(sample.radiosity, again, pool.scheduler());
  EXPECT_EQ(once, again);
  EXPECT_NE(once, sample.light);
}

TEST(ReceiverProducts, WithoutRowsNothingIsAdded) {
  Sample sample = make_sample(5);
  const ReceiverRows none;
  std::vector<Float3> light = sample.light;
  ReceiverProducts(none, sample.area).add(sample.radiosity, light);
  EXPECT_EQ(light, sample.light);
}

}  // namespace
}  // namespace rebounce::test_receiver_products

// Embree's tracer in a process that uses TBB itself.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <vector>

#include "runtime/rays/ray_tracer.h"

namespace rebounce::test_ray_tracer_threads {
namespace {

std::size_t tbb_threads() {
  return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
}

struct Soup {
  std::vector<Float3> position;
  std::vector<Uint3> triangle;
};

/// Small triangles in a unit cube, each of them twice.
Soup triangles_in_pairs(std::mt19937& random, std::uint32_t count) {
  const auto uniform = [&] { return static_cast<float>(random() >> 8U) * 0x1p-24F; };
  Soup soup;
  for (std::uint32_t k = 0; k < count; ++k) {
    const Float3 middle = {uniform(), uniform(), uniform()};
    for (int corner = 0; corner < 3; ++corner) {
      soup.position.push_back({middle[0] + 0.1F * uniform(), middle[1] + 0.1F * uniform(),
                               middle[2] + 0.1F * uniform()});
    }
    soup.triangle.insert(soup.triangle.end(), 2, {3 * k, 3 * k + 1, 3 * k + 2});
  }
  return soup;
}

/// The triangle that each of `rays` meets first, of a tracer made while TBB may use `threads`.
std::vector<std::uint32_t> met_triangles(const Soup& soup, const std::vector<Ray>& rays,
                                         std::size_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const RayTracer tracer(soup.position, soup.triangle);
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  std::vector<std::uint32_t> met(hits.size());
  std::ranges::transform(hits, met.begin(), &Hit::triangle);
  return met;
}

TEST(RayTracerThreads, TbbKeepsItsThreadsWhileATracerLives) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 4);
  std::mt19937 random(1);
  const Soup soup = triangles_in_pairs(random, 100);
  const RayTracer tracer(soup.position, soup.triangle);
  EXPECT_EQ(tbb_threads(), 4U);
}

TEST(RayTracerThreads, TheChoiceBetweenCoincidentTrianglesDoesNotDependOnThreads) {
  constexpr unsigned kSeed = 7;
  std::printf("seed %u\n", kSeed);
  std::mt19937 random(kSeed);
  const auto uniform = [&] { return static_cast<float>(random() >> 8U) * 0x1p-24F; };
  const Soup soup = triangles_in_pairs(random, 20000);
  std::vector<Ray> rays;
  for (int k = 0; k < 2000; ++k) {
    rays.push_back(
        {.origin = {uniform(), uniform(), -1}, .t_near = 0, .direction = {0, 0, 1}, .t_far = 10});
  }
  const std::vector<std::uint32_t> alone = met_triangles(soup, rays, 1);
  EXPECT_GT(std::ranges::count_if(alone, [](std::uint32_t t) { return t != kNone; }), 1000);
  EXPECT_EQ(alone, met_triangles(soup, rays, 4));
}

}  // namespace
}  // namespace rebounce::test_ray_tracer_threads

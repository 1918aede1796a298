#include "runtime/rays/triangle_tree.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include "runtime/rays/ray_tracer.h"

namespace rebounce::test_triangle_tree {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr unsigned kSeed = 20261123;

class TriangleTreeAndRayTracer : public ::testing::Test {
 protected:
  TriangleTreeAndRayTracer() { std::printf("seed %u\n", kSeed); }

  float uniform(float low, float high) {
    return low + (high - low) * static_cast<float>(engine_() >> 8) * 0x1p-24F;
  }
  Float3 in_box(float half) {
    const float x = uniform(-half, half), y = uniform(-half, half);
    return {x, y, uniform(-half, half)};
  }
  void add_triangles(int count, float size) {
    for (int k = 0; k < count; ++k) {
      const Float3 middle = in_box(1);
      const auto first = static_cast<std::uint32_t>(position_.size());
      for (int corner = 0; corner < 3; ++corner) {
        const Float3 by = in_box(size);
        position_.push_back({middle[0] + by[0], middle[1] + by[1], middle[2] + by[2]});
      }
      triangle_.push_back({first, first + 1, first + 2});
    }
  }
  std::vector<Ray> rays(int count, float t_far) {
    std::vector<Ray> made;
    for (int k = 0; k < count; ++k) {
      const Float3 origin = in_box(1.5F);
      made.push_back({.origin = origin, .t_near = 0, .direction = in_box(1), .t_far = t_far});
    }
    return made;
  }

  std::vector<Float3> position_;
  std::vector<Uint3> triangle_;

 private:
  std::mt19937 engine_{kSeed};
};

Hit nearest(const TriangleTree& tree, const Ray& ray) {
  Hit found{.t = ray.t_far};
  tree.trace(ray, [&](const Hit& hit) {
    found = hit;
    return hit.t;
  });
  return found;
}

TEST_F(TriangleTreeAndRayTracer, FindTheSameNearestHits) {
  for (const int count : {1, 3, 5, 17, 400, 5000}) {
    position_.clear();
    triangle_.clear();
    add_triangles(count, count > 1000 ? 0.05F : 0.4F);
    const TriangleTree tree(position_, triangle_);
    const RayTracer tracer(position_, triangle_);
    const std::vector<Ray> all = rays(5000, kInfinity);
    std::vector<Hit> expected(all.size());
    tracer.intersect(all, expected);
    int hits = 0, others = 0;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const Hit hit = nearest(tree, all[k]);
      hits += hit.triangle != kNone;
      // Rounding decides at the edge of a triangle, and between two that meet there.
      others += hit.triangle != expected[k].triangle;
      if (hit.triangle != expected[k].triangle || hit.triangle == kNone) continue;
      EXPECT_NEAR(hit.t, expected[k].t, 1e-4F * (1 + hit.t));
      EXPECT_NEAR(hit.u, expected[k].u, 2e-3F);
      EXPECT_NEAR(hit.v, expected[k].v, 2e-3F);
      EXPECT_EQ(hit.front, expected[k].front);
    }
    EXPECT_GT(hits, 0) << count;
    EXPECT_LE(others, 2) << count;
  }
}

TEST_F(TriangleTreeAndRayTracer, EndTheirRaysAtTheSamePlace) {
  add_triangles(400, 0.4F);
  const TriangleTree tree(position_, triangle_);
  const RayTracer tracer(position_, triangle_);
  std::vector<Ray> all = rays(10000, 0.8F);
  int hits = 0, others = 0;
  for (Ray& ray : all) {
    const bool hit = nearest(tree, ray).triangle != kNone;
    tracer.occluded({&ray, 1});
    hits += hit;
    others += hit != is_occluded(ray);
  }
  EXPECT_GT(hits, 2000);
  EXPECT_LT(hits, 8000);
  EXPECT_LE(others, 2);
}

TEST_F(TriangleTreeAndRayTracer, MeetEachTriangleOnce) {
  const std::vector<Float3> corner = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Uint3> same(100, Uint3{0, 1, 2});  // no plane parts them
  const TriangleTree tree(corner, same);
  std::vector<int> met(same.size());
  const Ray ray{.origin = {0.2F, 0.3F, 1}, .t_near = 0, .direction = {0, 0, -1}, .t_far = 2};
  tree.trace(ray, [&](const Hit& hit) {
    ++met[hit.triangle];
    return ray.t_far;
  });
  EXPECT_EQ(met, std::vector<int>(same.size(), 1));
}

}  // namespace
}  // namespace rebounce::test_triangle_tree

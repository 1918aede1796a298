// View factors of 22,000 facets: what their users wait for.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "precompute/facets/view_factors.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/ray_tracer.h"
#include "tests/precompute/facets/city_facets.h"

namespace rebounce::test_view_factors_large {
namespace {

// Their noise is some 0.0003 (lab/098).
constexpr std::size_t kRays = 1 << 17;
constexpr std::size_t kFacetsTried = 40;

/// Light that leaves triangles by the cosine law, followed by rays: what meets fronts.
class CountedRays {
 public:
  explicit CountedRays(const Facets& facets)
      : facets_(facets), tracer_(positions_of(facets), triangles_of(facets)) {}

  /// The row sum of `facet`, by kRays rays from evenly spread points in evenly spread directions.
  double row_sum(std::size_t facet) const {
    const std::span<const std::uint32_t> corner = facets_.corners(facet);
    const glm::dvec3 a = facets_.vertex[corner[0]];
    const glm::dvec3 b = facets_.vertex[corner[1]] - a, c = facets_.vertex[corner[2]] - a;
    const glm::dvec3 normal = glm::normalize(glm::cross(b, c));
    const glm::dvec3 u = glm::normalize(b), v = glm::cross(normal, u);
    std::vector<Ray> rays(kRays);
    for (std::size_t k = 0; k < kRays; ++k) {
      const double along = std::sqrt(spread(k, 1)), across = spread(k, 2);
      const double sine = std::sqrt(spread(k, 3)), angle = 2 * std::numbers::pi * spread(k, 4);
      const Float3 point = to_float3(a + along * ((1 - across) * b + across * c));
      rays[k].origin = tracer_.offset_point(point, to_float3(normal));
      rays[k].direction = to_float3(sine * std::cos(angle) * u + sine * std::sin(angle) * v +
                                    std::sqrt(1 - sine * sine) * normal);
      rays[k].t_near = 0;
      rays[k].t_far = std::numeric_limits<float>::infinity();
    }
    std::vector<Hit> hits(kRays);
    tracer_.intersect(rays, hits);
    const auto fronts = std::ranges::count_if(
        hits, [](const Hit& hit) { return hit.triangle != kNone && hit.front; });
    return static_cast<double>(fronts) / kRays;
  }

 private:
  /// Number k of an even sequence in [0, 1), of its `axis` of four: multiples of powers of the root
  /// of x^5 = x + 1 (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
  static double spread(std::size_t k, int axis) {
    const double x = 0.5 + static_cast<double>(k + 1) * std::pow(1.1673039782614187, -axis);
    return x - std::floor(x);
  }

  static std::vector<Float3> positions_of(const Facets& facets) {
    std::vector<Float3> positions;
    for (const glm::dvec3& p : facets.vertex) positions.push_back(to_float3(p));
    return positions;
  }

  static std::vector<Uint3> triangles_of(const Facets& facets) {
    std::vector<Uint3> triangles;
    for (std::size_t k = 0; k < facets.size(); ++k) {
      const std::span<const std::uint32_t> corner = facets.corners(k);
      triangles.push_back({corner[0], corner[1], corner[2]});
    }
    return triangles;
  }

  const Facets& facets_;
  RayTracer tracer_;
};

void expect_right_rows(const Facets& facets) {
  const std::clock_t begin = std::clock();
  const ViewFactors f = compute_view_factors(facets);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  const std::vector<double> sum = row_sums(f);
  double moved = 0, raw_error = 0, error = 0, blocked = 0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    raw_error =
        std::max(raw_error, std::abs(f.raw_row_sum[i] + f.raw_sky[i] + f.raw_blocked[i] - 1));
    error = std::max(error, std::abs(sum[i] + f.sky[i] + f.blocked[i] - 1));
    moved = std::max(moved, std::abs(sum[i] - f.raw_row_sum[i]));
    blocked = std::max(blocked, f.blocked[i]);
  }
  std::printf(
      "%zu facets, %zu factors, %.0f s of processor time; rows and sky off 1 by %.1e raw, "
      "%.1e closed; rows moved by %.1e; blocked %.1e\n",
      f.size(), f.factor.size(), seconds, raw_error, error, moved, blocked);
  const CountedRays rays(facets);
  for (std::size_t i = 0; i < f.size(); i += f.size() / kFacetsTried) {
    const double counted = rays.row_sum(i);
    EXPECT_NEAR(f.raw_row_sum[i], counted, 1e-3) << "facet " << i;
    EXPECT_NEAR(f.sky[i], 1 - counted, 1e-3) << "facet " << i;
  }
  EXPECT_LT(error, 1e-5);
  EXPECT_LT(moved, 1e-3);
  EXPECT_LT(blocked, 1e-3);
  EXPECT_LT(seconds, 2 * 200);  // on two cores
}

TEST(ViewFactorsLarge, OfAStreet) {
  expect_right_rows(test::street_canyon(2));
}

TEST(ViewFactorsLarge, OfACourtyard) {
  expect_right_rows(test::courtyard(2));
}

}  // namespace
}  // namespace rebounce::test_view_factors_large

#include "precompute/exchange/pairs/form_factor_kernel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

/// A convex polygon: a triangle cut by one plane has at most four corners.
struct Polygon {
  std::array<glm::dvec3, 4> vertex;
  int count = 0;
};

// Points closer to a plane than this fraction of the size of the triangles count as on it.
constexpr double kPlaneTolerance = 1e-7;

double plane_tolerance(const FlatTriangle& a, const FlatTriangle& b) {
  return kPlaneTolerance * std::max(a.radius, b.radius);
}

struct PlaneSide {
  double lowest, highest;
};

/// Signed distances of the corners of `t` from the plane of `plane`.
PlaneSide side_of_plane(const FlatTriangle& t, const FlatTriangle& plane) {
  const double d0 = glm::dot(plane.normal, t.vertex[0] - plane.centroid);
  const double d1 = glm::dot(plane.normal, t.vertex[1] - plane.centroid);
  const double d2 = glm::dot(plane.normal, t.vertex[2] - plane.centroid);
  return {std::min({d0, d1, d2}), std::max({d0, d1, d2})};
}

Polygon clip_to_front(const FlatTriangle& t, const FlatTriangle& plane, double tolerance) {
  Polygon result;
  std::array<double, 3> distance;
  for (int k = 0; k < 3; ++k) {
    distance[k] = glm::dot(plane.normal, t.vertex[k] - plane.centroid);
    if (std::abs(distance[k]) <= tolerance) distance[k] = 0;
  }
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (distance[k] >= 0) result.vertex[result.count++] = t.vertex[k];
    if ((distance[k] < 0) != (distance[next] < 0) && distance[k] != 0 && distance[next] != 0) {
      const double s = distance[k] / (distance[k] - distance[next]);
      result.vertex[result.count++] = glm::mix(t.vertex[k], t.vertex[next], s);
    }
  }
  return result;
}

struct Segment {
  glm::dvec3 begin, direction;  // direction is a unit vector
  double length;
};

Segment make_segment(const glm::dvec3& a, const glm::dvec3& b) {
  const double length = glm::length(b - a);
  return {a, length > 0 ? (b - a) / length : glm::dvec3(0), length};
}

/// The integral of ln |x - y| over y on `segment`, in closed form.
double integrate_log_distance(const glm::dvec3& x, const Segment& segment) {
  const glm::dvec3 to_begin = segment.begin - x;
  const double u0 = glm::dot(to_begin, segment.direction), u1 = u0 + segment.length;
  const glm::dvec3 across = to_begin - u0 * segment.direction;
  const double d2 = glm::dot(across, across), d = std::sqrt(d2);
  const auto primitive = [&](double u) {
    const double r2 = u * u + d2;
    return r2 > 0 ? 0.5 * u * std::log(r2) - u : 0.0;
  };
  // atan(u1/d) - atan(u0/d) as one angle.
  const double angle = std::atan2(d * segment.length, d2 + u0 * u1);
  return primitive(u1) - primitive(u0) + d * angle;
}

// Gauss-Legendre, 12 points on [-1, 1] (Abramowitz and Stegun, table 25.4).
constexpr std::array<double, 6> kGaussNode = {0.125233408511468915, 0.367831498998180194,
                                              0.587317954286617447, 0.769902674194304687,
                                              0.904117256370474857, 0.981560634246719251};
constexpr std::array<double, 6> kGaussWeight = {0.249147045813402785, 0.233492536538354809,
                                                0.203167426723065922, 0.160078328543346226,
                                                0.106939325995318431, 0.0471753363865118272};

/// Integrates f over [begin, end] after the substitution v -> v²(3 - 2v), which weakens logarithmic
/// singularities at both ends.
template <typename Function>
double integrate_graded(double begin, double end, const Function& f) {
  double sum = 0;
  const auto add = [&](double node, double weight) {
    const double v = 0.5 * (1 + node);
    sum += weight * 3 * v * (1 - v) * f(begin + (end - begin) * v * v * (3 - 2 * v));
  };
  for (std::size_t k = 0; k < kGaussNode.size(); ++k) {
    add(-kGaussNode[k], kGaussWeight[k]);
    add(kGaussNode[k], kGaussWeight[k]);
  }
  return sum * (end - begin);
}

/// The place on the line of `a` that is closest to the line of `b`; arbitrary if they are parallel.
double closest_approach(const Segment& a, const Segment& b) {
  const double cosine = glm::dot(a.direction, b.direction);
  const double sine_squared = 1 - cosine * cosine;
  if (sine_squared < 1e-12) return 0;
  const glm::dvec3 d = b.begin - a.begin;
  return (glm::dot(d, a.direction) - cosine * glm::dot(d, b.direction)) / sine_squared;
}

/// The double integral of ln r over two segments. The outer interval is cut where the inner
/// integral is least smooth: at the ends of the inner segment, and where the two segments cross or
/// nearly cross.
double integrate_log_distance(const Segment& outer, const Segment& inner) {
  const glm::dvec3 inner_end = inner.begin + inner.length * inner.direction;
  std::array<double, 3> candidate = {glm::dot(inner.begin - outer.begin, outer.direction),
                                     glm::dot(inner_end - outer.begin, outer.direction),
                                     closest_approach(outer, inner)};
  std::sort(candidate.begin(), candidate.end());
  std::array<double, 5> cut = {0};
  int count = 1;
  for (const double s : candidate) {
    if (s > cut[count - 1] + 1e-9 * outer.length && s < (1 - 1e-9) * outer.length) cut[count++] = s;
  }
  cut[count] = outer.length;
  double sum = 0;
  for (int k = 0; k < count; ++k) {
    sum += integrate_graded(cut[k], cut[k + 1], [&](double s) {
      return integrate_log_distance(outer.begin + s * outer.direction, inner);
    });
  }
  return sum;
}

double contour_integral(const Polygon& a, const Polygon& b) {
  double sum = 0;
  for (int i = 0; i < a.count; ++i) {
    const Segment ea = make_segment(a.vertex[i], a.vertex[(i + 1) % a.count]);
    for (int j = 0; j < b.count; ++j) {
      const Segment eb = make_segment(b.vertex[j], b.vertex[(j + 1) % b.count]);
      const double cosine = glm::dot(ea.direction, eb.direction);
      if (std::abs(cosine) > 1e-14) sum += cosine * integrate_log_distance(ea, eb);
    }
  }
  return std::max(0.0, sum / (2 * std::numbers::pi));
}

template <std::size_t kCount>
struct TriangleRule {
  std::array<std::array<double, 3>, kCount> point;  // barycentric
  std::array<double, kCount> weight;                // sums to 1
};

// G. Strang and G. J. Fix, "An Analysis of the Finite Element Method", 1973: rules of degree 2 and
// degree 5.
constexpr TriangleRule<3> kDegree2 = {
    {{{2.0 / 3, 1.0 / 6, 1.0 / 6}, {1.0 / 6, 2.0 / 3, 1.0 / 6}, {1.0 / 6, 1.0 / 6, 2.0 / 3}}},
    {1.0 / 3, 1.0 / 3, 1.0 / 3}};
constexpr double kA1 = 0.797426985353087, kB1 = 0.101286507323456;
constexpr double kA2 = 0.059715871789770, kB2 = 0.470142064105115;
constexpr double kW0 = 0.225, kW1 = 0.125939180544827, kW2 = 0.132394152788506;
constexpr TriangleRule<7> kDegree5 = {{{{1.0 / 3, 1.0 / 3, 1.0 / 3},
                                        {kA1, kB1, kB1},
                                        {kB1, kA1, kB1},
                                        {kB1, kB1, kA1},
                                        {kA2, kB2, kB2},
                                        {kB2, kA2, kB2},
                                        {kB2, kB2, kA2}}},
                                      {kW0, kW1, kW1, kW1, kW2, kW2, kW2}};

template <std::size_t kCount>
double quadrature(const FlatTriangle& a, const FlatTriangle& b, const TriangleRule<kCount>& rule) {
  std::array<glm::dvec3, kCount> y;
  for (std::size_t k = 0; k < kCount; ++k) {
    y[k] = rule.point[k][0] * b.vertex[0] + rule.point[k][1] * b.vertex[1] +
           rule.point[k][2] * b.vertex[2];
  }
  double sum = 0;
  for (std::size_t k = 0; k < kCount; ++k) {
    const glm::dvec3 x = rule.point[k][0] * a.vertex[0] + rule.point[k][1] * a.vertex[1] +
                         rule.point[k][2] * a.vertex[2];
    double inner = 0;
    for (std::size_t l = 0; l < kCount; ++l) {
      inner += rule.weight[l] * point_kernel(x, a.normal, y[l], b.normal);
    }
    sum += rule.weight[k] * inner;
  }
  return a.area * b.area * sum;
}

// lab/003, over random pairs of triangles
// (tests/precompute/exchange/pairs/test_form_factor_kernel.cpp): a rule of degree p has an error
// below kErrorConstant q^(p+1), where q = (sum of radii) / distance, in all but a few of a thousand
// pairs.
constexpr double kErrorConstant2 = 0.1;
constexpr double kErrorConstant5 = 0.01;

}  // namespace

FlatTriangle::FlatTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c)
    : vertex{a, b, c} {
  const glm::dvec3 cross = glm::cross(b - a, c - a);
  const double length = glm::length(cross);
  area = 0.5 * length;
  normal = length > 0 ? cross / length : glm::dvec3(0);
  centroid = (a + b + c) / 3.0;
  for (const glm::dvec3& v : vertex) radius = std::max(radius, glm::distance(v, centroid));
}

double contour_exchange_area(const FlatTriangle& a, const FlatTriangle& b) {
  const double tolerance = plane_tolerance(a, b);
  const Polygon front_of_a = clip_to_front(a, b, tolerance);
  const Polygon front_of_b = clip_to_front(b, a, tolerance);
  if (front_of_a.count < 3 || front_of_b.count < 3) return 0;
  return contour_integral(front_of_a, front_of_b);
}

double unoccluded_exchange_area(const FlatTriangle& a, const FlatTriangle& b, double tolerance) {
  const double on_plane = plane_tolerance(a, b);
  const PlaneSide side_b = side_of_plane(b, a), side_a = side_of_plane(a, b);
  if (side_b.highest <= on_plane || side_a.highest <= on_plane) return 0;
  const bool cut = side_b.lowest < -on_plane || side_a.lowest < -on_plane;
  if (!cut) {
    const double distance = glm::distance(a.centroid, b.centroid);
    const double q = (a.radius + b.radius) / std::max(distance, 1e-300);
    const double q3 = q * q * q;
    if (kErrorConstant2 * q3 <= tolerance) return quadrature(a, b, kDegree2);
    if (kErrorConstant5 * q3 * q3 <= tolerance) return quadrature(a, b, kDegree5);
  }
  return contour_exchange_area(a, b);
}

}  // namespace rebounce

#include "bench/known_form_factors.h"

#include <array>
#include <cmath>
#include <numbers>

#include "precompute/exchange/pairs/form_factor_kernel.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/form_factor_sums.h"
#include "tests/support/view_factor_table.h"

namespace rebounce::bench {
namespace {

using Polygon = std::vector<glm::dvec3>;

// Of tests/reference/view_factors.tsv: unit squares with a common edge of length 1 and 1/2.
constexpr double kOppositeSquares = 0.19982489569839;

/// At height z, seen from above (`up`) or below.
Polygon flat(const Rectangle& r, double z, bool up) {
  Polygon p = {{r.x0, r.y0, z}, {r.x1, r.y0, z}, {r.x1, r.y1, z}, {r.x0, r.y1, z}};
  if (!up) std::swap(p[1], p[3]);
  return p;
}

KnownFormFactor between(const std::string& name, const Polygon& from, const Polygon& to,
                        const std::vector<Polygon>& screens, double factor) {
  KnownFormFactor known{name, test::scene_of_two(from, to), factor};
  known.scene.materials.resize(3, known.scene.materials[0]);
  for (const Polygon& screen : screens) test::add_polygon(known.scene, screen, 2);
  return known;
}

/// Four rectangles that leave `hole` open in `outer`.
std::vector<Polygon> frame(const Rectangle& outer, const Rectangle& hole, double z) {
  return {flat({outer.x0, hole.x0, outer.y0, outer.y1}, z, true),
          flat({hole.x1, outer.x1, outer.y0, outer.y1}, z, true),
          flat({hole.x0, hole.x1, outer.y0, hole.y0}, z, true),
          flat({hole.x0, hole.x1, hole.y1, outer.y1}, z, true)};
}

/// View factor between rectangles of width `w` and height `h` at right angles with a common edge of
/// length `l`. Howell's catalogue, C-14.
double perpendicular_rectangles(double w, double h, double l) {
  const double a = h / l, b = w / l, a2 = a * a, b2 = b * b, c2 = a2 + b2;
  const double logarithm = std::log((1 + b2) * (1 + a2) / (1 + c2)) +
                           b2 * std::log(b2 * (1 + c2) / ((1 + b2) * c2)) +
                           a2 * std::log(a2 * (1 + c2) / ((1 + a2) * c2));
  return (b * std::atan(1 / b) + a * std::atan(1 / a) -
          std::sqrt(c2) * std::atan(1 / std::sqrt(c2)) + logarithm / 4) /
         (std::numbers::pi * b);
}

/// By mirror symmetry just half of the exchange crosses the open half of the plane halfway.
void add_halves(std::vector<KnownFormFactor>& cases) {
  const Rectangle unit = {0, 1, 0, 1};
  const Polygon below = flat(unit, 0, true), above = flat(unit, 1, false);
  cases.push_back(between("half screen", below, above, {flat({-0.1, 0.5, -0.1, 1.1}, 0.5, true)},
                          0.5 * kOppositeSquares));
  cases.push_back(
      between("two quarter screens", below, above,
              {flat({-0.1, 0.5, -0.1, 0.5}, 0.5, true), flat({0.5, 1.1, 0.5, 1.1}, 0.5, true)},
              0.5 * kOppositeSquares));
}

/// A wall across both surfaces: each half sees only its own.
void add_partitions(std::vector<KnownFormFactor>& cases) {
  const double at = 0.37;
  const Polygon wall = {{at, 0, 0}, {at, 1, 0}, {at, 1, 1}, {at, 0, 1}};
  const double opposite = at * parallel_rectangles({0, at, 0, 1}, {0, at, 0, 1}, 1) +
                          (1 - at) * parallel_rectangles({at, 1, 0, 1}, {at, 1, 0, 1}, 1);
  const Rectangle unit = {0, 1, 0, 1};
  cases.push_back(
      between("opposite, partition", flat(unit, 0, true), flat(unit, 1, false), {wall}, opposite));
  const double adjacent =
      at * perpendicular_rectangles(1, 1, at) + (1 - at) * perpendicular_rectangles(1, 1, 1 - at);
  const Polygon side = {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}};
  cases.push_back(between("adjacent, partition", flat(unit, 0, true), side, {wall}, adjacent));
}

/// All light that enters the opening halfway meets the upper square, which is just wide enough:
/// what is exchanged is what the opening gets. What meets a plate there would have met the square.
void add_openings(std::vector<KnownFormFactor>& cases) {
  const Rectangle unit = {0, 1, 0, 1}, wide = {-0.9, 1.9, -0.9, 1.9},
                  halfway = {-0.46, 1.46, -0.46, 1.46};
  const Polygon below = flat(unit, 0, true), above = flat(wide, 1, false);
  const Rectangle square = {0.31, 0.69, 0.31, 0.69}, slot = {0.1, 0.9, 0.47, 0.53};
  const auto to_opening = [&](const Rectangle& r) { return parallel_rectangles(unit, r, 0.5); };
  cases.push_back(
      between("square hole", below, above, frame(halfway, square, 0.5), to_opening(square)));
  cases.push_back(between("slot", below, above, frame(halfway, slot, 0.5), to_opening(slot)));
  const double open = parallel_rectangles(unit, wide, 1);
  cases.push_back(
      between("square plate", below, above, {flat(square, 0.5, true)}, open - to_opening(square)));
  cases.push_back(between("strip", below, above, {flat(slot, 0.5, true)}, open - to_opening(slot)));
}

/// By the contour integral of the triangles themselves.
double contour_factor(const Scene& scene) {
  std::array<std::vector<FlatTriangle>, 2> side;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const Uint3& v = scene.triangle[t];
    side[scene.triangle_material[t]].emplace_back(to_dvec3(scene.position[v[0]]),
                                                  to_dvec3(scene.position[v[1]]),
                                                  to_dvec3(scene.position[v[2]]));
  }
  double exchange = 0, area = 0;
  for (const FlatTriangle& a : side[0]) {
    area += a.area;
    for (const FlatTriangle& b : side[1]) exchange += contour_exchange_area(a, b);
  }
  return exchange / area;
}

}  // namespace

double parallel_rectangles(const Rectangle& from, const Rectangle& to, double z) {
  const std::array<double, 2> x = {from.x0, from.x1}, y = {from.y0, from.y1}, u = {to.x0, to.x1},
                              v = {to.y0, to.y1};
  const auto term = [&](double dx, double dy) {
    const double p = std::sqrt(dx * dx + z * z), q = std::sqrt(dy * dy + z * z);
    return dy * p * std::atan(dy / p) + dx * q * std::atan(dx / q) -
           0.5 * z * z * std::log(dx * dx + dy * dy + z * z);
  };
  double sum = 0;
  for (int k = 0; k < 16; ++k) {
    const int i = k & 1, j = (k >> 1) & 1, l = (k >> 2) & 1, m = k >> 3;
    const double sign = (i + j + l + m) % 2 == 0 ? 1 : -1;
    sum += sign * term(x[i] - u[l], y[j] - v[m]);
  }
  return sum / (2 * std::numbers::pi * (from.x1 - from.x0) * (from.y1 - from.y0));
}

std::vector<KnownFormFactor> tabled_form_factors(const std::string& path) {
  std::vector<KnownFormFactor> cases;
  for (const test::ViewFactorCase& c : test::read_view_factors(path)) {
    if (c.id.starts_with("INF")) continue;
    KnownFormFactor known{c.id, test::scene_of_two(c.a, c.b), c.factor};
    if (c.factor > 0) known.model_error = std::abs(contour_factor(known.scene) / c.factor - 1);
    cases.push_back(std::move(known));
  }
  return cases;
}

std::vector<KnownFormFactor> hidden_form_factors() {
  std::vector<KnownFormFactor> cases;
  add_halves(cases);
  add_partitions(cases);
  add_openings(cases);
  return cases;
}

}  // namespace rebounce::bench

// Form factors past screens, holes, slots, plates and partitions, against closed forms.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "precompute/exchange/pairs/form_factors.h"
#include "tests/support/form_factor_sums.h"

namespace rebounce::test_hidden_form_factors {
namespace {

using Polygon = std::vector<glm::dvec3>;

struct Rectangle {
  double x0, x1, y0, y1;
};

constexpr Rectangle kUnit = {0, 1, 0, 1};

/// At height z, seen from above (`up`) or below.
Polygon flat(const Rectangle& r, double z, bool up) {
  Polygon p = {{r.x0, r.y0, z}, {r.x1, r.y0, z}, {r.x1, r.y1, z}, {r.x0, r.y1, z}};
  if (!up) std::swap(p[1], p[3]);
  return p;
}

/// Four rectangles that leave `hole` open in `outer`.
std::vector<Polygon> frame(const Rectangle& outer, const Rectangle& hole, double z) {
  return {flat({outer.x0, hole.x0, outer.y0, outer.y1}, z, true),
          flat({hole.x1, outer.x1, outer.y0, outer.y1}, z, true),
          flat({hole.x0, hole.x1, outer.y0, hole.y0}, z, true),
          flat({hole.x0, hole.x1, hole.y1, outer.y1}, z, true)};
}

/// Of the default quality: 0.5 % of the factor, or 5e-5.
void expect_factor(const std::string& name, const Polygon& from, const Polygon& to,
                   const std::vector<Polygon>& screens, double factor) {
  Scene scene = test::scene_of_two(from, to);
  scene.materials.resize(3, scene.materials[0]);
  for (const Polygon& screen : screens) test::add_polygon(scene, screen, 2);
  const PatchModel model = make_patch_model(scene, {.patch_count = 600});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  EXPECT_NEAR(test::factor_between(model, f, 0, 1), factor, std::max(5e-3 * factor, 5e-5)) << name;
}

/// View factor from a rectangle to another one, parallel to it and facing it at distance `z`.
/// J. R. Howell's catalogue, C-13; J. R. Ehlert and T. F. Smith, "View factors for perpendicular
/// and parallel rectangular plates", 1993.
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

TEST(HiddenFormFactors, ScreensThatHideHalfLeaveHalf) {
  // By mirror symmetry just half of the exchange crosses the open half of the plane halfway.
  const Polygon below = flat(kUnit, 0, true), above = flat(kUnit, 1, false);
  const double half = 0.5 * parallel_rectangles(kUnit, kUnit, 1);
  expect_factor("half screen", below, above, {flat({-0.1, 0.5, -0.1, 1.1}, 0.5, true)}, half);
  expect_factor("two quarter screens", below, above,
                {flat({-0.1, 0.5, -0.1, 0.5}, 0.5, true), flat({0.5, 1.1, 0.5, 1.1}, 0.5, true)},
                half);
}

TEST(HiddenFormFactors, EachHalfBesideAPartitionSeesOnlyItsOwn) {
  const double at = 0.37;
  const Polygon wall = {{at, 0, 0}, {at, 1, 0}, {at, 1, 1}, {at, 0, 1}};
  const Rectangle left = {0, at, 0, 1}, right = {at, 1, 0, 1};
  expect_factor(
      "opposite", flat(kUnit, 0, true), flat(kUnit, 1, false), {wall},
      at * parallel_rectangles(left, left, 1) + (1 - at) * parallel_rectangles(right, right, 1));
  expect_factor(
      "adjacent", flat(kUnit, 0, true), {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, {wall},
      at * perpendicular_rectangles(1, 1, at) + (1 - at) * perpendicular_rectangles(1, 1, 1 - at));
}

TEST(HiddenFormFactors, WhatEntersAnOpeningIsWhatMeetsTheOtherSide) {
  // All light that enters the opening halfway meets the upper square, which is just wide enough:
  // what is exchanged is what the opening gets. What meets a plate there would have met the square.
  const Rectangle wide = {-0.9, 1.9, -0.9, 1.9}, halfway = {-0.46, 1.46, -0.46, 1.46},
                  square = {0.31, 0.69, 0.31, 0.69}, slot = {0.1, 0.9, 0.47, 0.53};
  const Polygon below = flat(kUnit, 0, true), above = flat(wide, 1, false);
  const double open = parallel_rectangles(kUnit, wide, 1);
  for (const Rectangle& opening : {square, slot}) {
    const double through = parallel_rectangles(kUnit, opening, 0.5);
    const std::string width = std::to_string(opening.y1 - opening.y0);
    expect_factor("opening of " + width, below, above, frame(halfway, opening, 0.5), through);
    expect_factor("plate of " + width, below, above, {flat(opening, 0.5, true)}, open - through);
  }
}

}  // namespace
}  // namespace rebounce::test_hidden_form_factors

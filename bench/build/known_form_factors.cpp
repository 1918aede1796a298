#include "bench/build/known_form_factors.h"

#include <array>
#include <cmath>
#include <fstream>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::bench {
namespace {

using Polygon = std::vector<glm::dvec3>;

struct Rectangle {
  double x0, x1, y0, y1;
};

// Of tests/reference/view_factors.tsv: unit squares with a common edge of length 1 and 1/2.
constexpr double kOppositeSquares = 0.19982489569839;

/// At height z, seen from above (`up`) or below.
Polygon flat(const Rectangle& r, double z, bool up) {
  Polygon p = {{r.x0, r.y0, z}, {r.x1, r.y0, z}, {r.x1, r.y1, z}, {r.x0, r.y1, z}};
  if (!up) std::swap(p[1], p[3]);
  return p;
}

/// Adds a flat convex polygon, counter-clockwise from its front, as a fan of triangles.
void add_polygon(Scene& scene, const Polygon& polygon, std::uint32_t material) {
  const auto first = static_cast<std::uint32_t>(scene.position.size());
  const auto count = static_cast<std::uint32_t>(polygon.size());
  const glm::dvec3 normal =
      glm::normalize(glm::cross(polygon[1] - polygon[0], polygon[2] - polygon[0]));
  for (const glm::dvec3& p : polygon) scene.position.push_back(to_float3(p));
  scene.normal.resize(first + count, to_float3(normal));
  scene.base_color_texcoord.resize(first + count);
  scene.emissive_texcoord.resize(first + count);
  scene.vertex_color.resize(first + count, {1, 1, 1});
  for (std::uint32_t k = 2; k < count; ++k) {
    scene.triangle.push_back({first, first + k - 1, first + k});
    scene.triangle_material.push_back(material);
  }
}

KnownFormFactor between(const std::string& name, const Polygon& from, const Polygon& to,
                        const std::vector<Polygon>& screens, double factor) {
  KnownFormFactor known{name, {}, factor};
  known.scene.name = name;
  known.scene.materials.resize(3);
  add_polygon(known.scene, from, 0);
  add_polygon(known.scene, to, 1);
  for (const Polygon& screen : screens) add_polygon(known.scene, screen, 2);
  return known;
}

/// Four rectangles that leave `hole` open in `outer`.
std::vector<Polygon> frame(const Rectangle& outer, const Rectangle& hole, double z) {
  return {flat({outer.x0, hole.x0, outer.y0, outer.y1}, z, true),
          flat({hole.x1, outer.x1, outer.y0, outer.y1}, z, true),
          flat({hole.x0, hole.x1, outer.y0, hole.y0}, z, true),
          flat({hole.x0, hole.x1, hole.y1, outer.y1}, z, true)};
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

Polygon polygon_of(const nlohmann::json& corners) {
  Polygon polygon;
  for (const auto& c : corners) polygon.emplace_back(c[0], c[1], c[2]);
  return polygon;
}

/// A field as CSV quotes it: in quotes, which are doubled inside.
std::string unquoted(const std::string& field) {
  if (!field.starts_with('"')) return field;
  std::string text = field.substr(1, field.size() - 2);
  for (std::size_t at = 0; (at = text.find("\"\"", at)) != std::string::npos; ++at) {
    text.erase(at, 1);
  }
  return text;
}

}  // namespace

std::vector<KnownFormFactor> tabled_form_factors(const std::string& path) {
  constexpr std::size_t kName = 0, kGeometry = 4, kFactor = 6;  // columns
  std::ifstream file(path);
  if (!file) throw Error(path + ": no such table");
  std::vector<KnownFormFactor> cases;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#') || line.starts_with("id\t")) continue;
    std::vector<std::string> field;
    std::stringstream stream(line);
    for (std::string text; std::getline(stream, text, '\t');) field.push_back(text);
    if (field.size() <= kFactor) throw Error(path + ": too few columns");
    const auto geometry = nlohmann::json::parse(unquoted(field[kGeometry]), nullptr, false);
    if (!geometry.contains("A1") || !geometry.contains("A2")) continue;
    cases.push_back(between(field[kName], polygon_of(geometry["A1"]), polygon_of(geometry["A2"]),
                            {}, std::stod(field[kFactor])));
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

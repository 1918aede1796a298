#pragma once

#include <cmath>
#include <fstream>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace rebounce::test {

/// A configuration with a known view factor, as two flat convex polygons, counter-clockwise from
/// their fronts.
struct ViewFactorCase {
  std::string id;
  std::vector<glm::dvec3> a, b;
  double factor = 0;
  /// What the polygons themselves differ by from the configuration (strips that are not infinitely
  /// long, discs with corners), as a part of the factor.
  double model_error = 0;
};

inline std::vector<glm::dvec3> polygon_from_json(const nlohmann::json& corners) {
  std::vector<glm::dvec3> polygon;
  for (const auto& c : corners) polygon.emplace_back(c[0], c[1], c[2]);
  return polygon;
}

/// A regular polygon with the area of the disc.
inline std::vector<glm::dvec3> disc_polygon(const nlohmann::json& disc) {
  constexpr int kCorners = 96;
  constexpr double kPi = std::numbers::pi;
  const double inscribed = 0.5 * kCorners * std::sin(2 * kPi / kCorners);
  const double radius = disc["r"].get<double>() * std::sqrt(kPi / inscribed);
  const double turn = disc["n"][2].get<double>() > 0 ? 1 : -1;
  std::vector<glm::dvec3> polygon;
  for (int k = 0; k < kCorners; ++k) {
    const double phi = turn * 2 * kPi * k / kCorners;
    polygon.emplace_back(disc["c"][0].get<double>() + radius * std::cos(phi),
                         disc["c"][1].get<double>() + radius * std::sin(phi), disc["c"][2]);
  }
  return polygon;
}

/// A differential element as a small square.
inline std::vector<glm::dvec3> element_polygon(const nlohmann::json& point) {
  constexpr double kHalf = 5e-4;
  const glm::dvec3 p(point[0], point[1], point[2]);
  return {p + glm::dvec3(-kHalf, -kHalf, 0), p + glm::dvec3(kHalf, -kHalf, 0),
          p + glm::dvec3(kHalf, kHalf, 0), p + glm::dvec3(-kHalf, kHalf, 0)};
}

/// The two-dimensional cases as strips 20,000 widths long.
inline void make_strips(const std::string& id, double h, ViewFactorCase& result) {
  constexpr double kLength = 20000;
  result.a = {{0, 0, 0}, {1, 0, 0}, {1, kLength, 0}, {0, kLength, 0}};
  if (id.starts_with("INF_PAR")) {
    result.b = {{0, kLength, h}, {1, kLength, h}, {1, 0, h}, {0, 0, h}};
  } else {
    result.b = {{0, 0, 0}, {0, kLength, 0}, {0, kLength, h}, {0, 0, h}};
  }
  result.model_error = 10 / kLength;
}

inline std::vector<std::string> split_tabs(const std::string& line) {
  std::vector<std::string> fields;
  std::stringstream stream(line);
  for (std::string field; std::getline(stream, field, '\t');) fields.push_back(field);
  return fields;
}

/// The JSON of the table's geometry column, which is quoted as CSV quotes.
inline nlohmann::json parse_geometry(std::string text) {
  if (text.starts_with('"')) {
    text = text.substr(1, text.size() - 2);
    for (std::size_t at = 0; (at = text.find("\"\"", at)) != std::string::npos; ++at) {
      text.erase(at, 1);
    }
  }
  return nlohmann::json::parse(text);
}

/// Every row of the table that two polygons can express (the row for a sum over a box is tested by
/// rooms).
inline std::vector<ViewFactorCase> read_view_factors(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("no table " + path);
  std::vector<ViewFactorCase> cases;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#') || line.starts_with("id\t")) continue;
    const std::vector<std::string> fields = split_tabs(line);
    const nlohmann::json geometry = parse_geometry(fields[4]);
    ViewFactorCase c;
    c.id = fields[0];
    c.factor = std::stod(fields[6]);
    if (geometry.contains("A1")) {
      c.a = polygon_from_json(geometry["A1"]);
      c.b = polygon_from_json(geometry["A2"]);
    } else if (geometry.contains("P")) {
      c.a = element_polygon(geometry["P"][0]);
      c.b = polygon_from_json(geometry["A2"]);
      c.model_error = 1e-6;
    } else if (geometry.contains("disc1")) {
      c.a = disc_polygon(geometry["disc1"]);
      c.b = disc_polygon(geometry["disc2"]);
      c.model_error = 3e-4;
    } else if (geometry.contains("2D")) {
      const std::string& parameters = fields[3];
      make_strips(c.id, std::stod(parameters.substr(parameters.find("h=") + 2)), c);
    } else {
      continue;
    }
    cases.push_back(c);
  }
  return cases;
}

}  // namespace rebounce::test

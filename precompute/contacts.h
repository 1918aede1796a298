#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "rebounce/precompute/scene.h"

namespace rebounce {

/// A straight line on a triangle along which other surfaces cross it or stand on it.
class ContactLine {
 public:
  /// `begin` and `end` (metres) must differ; `normal` is the triangle's, unit.
  ContactLine(const glm::dvec3& begin, const glm::dvec3& end, const glm::dvec3& normal);

  const glm::dvec3& begin() const { return begin_; }
  glm::dvec3 end() const { return begin_ + length_ * direction_; }
  double length() const { return length_; }

  /// Metres from the (endless) line, signed, in the plane of the triangle.
  double across(const glm::dvec3& point) const { return glm::dot(point - begin_, across_); }
  /// Metres from the beginning, along the line.
  double along(const glm::dvec3& point) const { return glm::dot(point - begin_, direction_); }

  /// True if more than `tolerance` metres of it lie inside of a triangle in its plane. `across` are
  /// the distances of the triangle's corners from it: 0 for those that count as lying on it.
  bool crosses(const std::array<glm::dvec3, 3>& corner, const std::array<double, 3>& across,
               double tolerance) const;

 private:
  glm::dvec3 begin_, direction_, across_;
  double length_;
};

struct Contact {
  std::uint32_t triangle;
  ContactLine line;  ///< may go on beyond the triangle
};

struct ContactSettings {
  double shortest;   ///< metres: neither shorter contacts count nor triangles without such an edge
  double tolerance;  ///< metres: what is closer than this is in the same place
  double gap;        ///< metres: what hangs less than this above a triangle stands on it
};

/// Finds the contacts of every triangle, those of the first triangle first: where others pass
/// through it, where they have an edge in its plane (a wall that stands on a floor), and the
/// outlines of what lies flat on it (a rug, a lamp under a ceiling). Pieces that lie in one line
/// are one contact. What is wholly behind a one-sided triangle makes none.
std::vector<Contact> find_contacts(const Scene& scene, const ContactSettings& settings);

}  // namespace rebounce

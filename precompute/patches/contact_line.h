#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

namespace rebounce {

/// A straight line on a triangle along which other surfaces cross it or stand on it.
class ContactLine {
 public:
  /// `begin` and `end` (metres) must differ; `normal` is the unit normal of the triangle.
  ContactLine(const glm::dvec3& begin, const glm::dvec3& end, const glm::dvec3& normal);

  const glm::dvec3& begin() const { return begin_; }
  glm::dvec3 end() const { return begin_ + length_ * direction_; }
  double length() const { return length_; }

  /// Signed distance in metres from the (endless) line, in the plane of the triangle.
  double across(const glm::dvec3& point) const { return glm::dot(point - begin_, across_); }
  /// Distance in metres from the beginning, along the line.
  double along(const glm::dvec3& point) const { return glm::dot(point - begin_, direction_); }
  /// Unit vectors in the plane of the triangle: the directions in which `across` and `along` grow.
  const glm::dvec3& across_direction() const { return across_; }
  const glm::dvec3& direction() const { return direction_; }

  /// True if more than `tolerance` metres of the line lie inside a triangle in its plane. `across`
  /// are the distances of the corners of the triangle from the line: 0 for corners that count as
  /// lying on it.
  bool crosses(const std::array<glm::dvec3, 3>& corner, const std::array<double, 3>& across,
               double tolerance) const;

  /// The part of the line from `first` to `last` metres along it.
  ContactLine part(double first, double last) const;

 private:
  glm::dvec3 begin_, direction_, across_;
  double length_;
};

/// Joins lines of one plane into few long ones: the longest with all lines that continue or overlap
/// it, then the longest of the rest, and so on. A line continues another if all of it is within
/// `width` metres of the endless line, and no farther than `tolerance` metres along it. Among
/// equally long lines the order decides. Takes about n log n steps.
std::vector<ContactLine> join_lines(std::vector<ContactLine> lines, double width, double tolerance);

}  // namespace rebounce

#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

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
  /// Unit, in the plane of the triangle: where `across` grows, and `along`.
  const glm::dvec3& across_direction() const { return across_; }
  const glm::dvec3& direction() const { return direction_; }

  /// True if more than `tolerance` metres of it lie inside of a triangle in its plane. `across` are
  /// the distances of the triangle's corners from it: 0 for those that count as lying on it.
  bool crosses(const std::array<glm::dvec3, 3>& corner, const std::array<double, 3>& across,
               double tolerance) const;

  /// The same line from `first` to `last` metres along it.
  ContactLine part(double first, double last) const;

 private:
  glm::dvec3 begin_, direction_, across_;
  double length_;
};

/// Lines of one plane as few long ones: the longest, with all that goes on from it or overlaps it,
/// then the longest of the rest, and so on. A line goes on in another where all of that one is
/// within `width` metres of the endless line, and no farther than `tolerance` metres along it.
/// Which of equally long lines comes first depends on their order. Takes about n log n steps.
std::vector<ContactLine> join_lines(std::vector<ContactLine> lines, double width, double tolerance);

}  // namespace rebounce

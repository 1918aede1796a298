#include "contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "box_tree.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/triangle.h"

namespace rebounce {
namespace {

// Lines this many tolerances apart are one: two would leave a strip of slivers between them.
constexpr double kSameLine = 8;

using Corners = TriangleCorners;
using Heights = std::array<double, 3>;      // of the corners of a triangle above a plane, metres
using Segment = std::array<glm::dvec3, 2>;  // its ends

/// Edges by their ends, the lower first, and of how many triangles each is one.
using Outline = std::map<std::array<Float3, 2>, int>;

double longest_edge(const Corners& p) {
  return std::max(
      {glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
}

class ContactFinder {
 public:
  ContactFinder(const Scene& scene, const ContactSettings& settings)
      : scene_(scene), settings_(settings), large_(find_large()), tree_(make_boxes()) {}

  std::vector<Contact> find() const {
    std::vector<std::vector<ContactLine>> lines(large_.size());
#pragma omp parallel
    {
      std::vector<std::uint32_t> near;
#pragma omp for schedule(dynamic, 64)
      for (std::size_t k = 0; k < large_.size(); ++k) {
        tree_.find(box_of(large_[k]), near);
        lines[k] = lines_on(large_[k], near);
      }
    }
    std::vector<Contact> contacts;
    for (std::size_t k = 0; k < large_.size(); ++k) {
      for (const ContactLine& line : lines[k]) contacts.push_back({large_[k], line});
    }
    return contacts;
  }

 private:
  std::vector<std::uint32_t> find_large() const {
    std::vector<std::uint32_t> large;
    for (std::uint32_t t = 0; t < scene_.triangle.size(); ++t) {
      if (longest_edge(corners_of(scene_, t)) >= settings_.shortest) large.push_back(t);
    }
    return large;
  }

  std::vector<Box> make_boxes() const {
    std::vector<Box> boxes;
    boxes.reserve(large_.size());
    for (const std::uint32_t t : large_) boxes.push_back(box_of(t));
    return boxes;
  }

  Box box_of(std::uint32_t t) const {
    Box box;
    for (const std::uint32_t v : scene_.triangle[t]) box.add(to_glm(scene_.position[v]));
    const glm::vec3 margin(static_cast<float>(settings_.gap));
    return {box.low - margin, box.high + margin};
  }

  /// Contacts of triangle t with the large triangles number `near`.
  std::vector<ContactLine> lines_on(std::uint32_t t, const std::vector<std::uint32_t>& near) const {
    const Corners p = corners_of(scene_, t);
    const glm::dvec3 normal = front_normal(p);
    const bool both_sides = scene_.materials[scene_.triangle_material[t]].double_sided;
    std::vector<ContactLine> lines;
    Outline outline;
    for (const std::uint32_t other : near) {
      if (large_[other] == t) continue;
      const Corners q = corners_of(scene_, large_[other]);
      Heights height;
      for (int k = 0; k < 3; ++k) height[k] = glm::dot(q[k] - p[0], normal);
      const auto [lowest, highest] = std::ranges::minmax(height);
      const bool flat = lowest >= -settings_.gap && highest <= settings_.gap;
      const bool behind = highest <= (flat ? -settings_.tolerance : settings_.tolerance);
      if (behind && !both_sides) continue;
      if (flat) {
        add_edges(large_[other], outline);
      } else if (const auto ends = meet(q, height)) {
        add(*ends, p[0], normal, lines);
      }
    }
    for (const auto& [edge, count] : outline) {
      if (count == 1) add({to_dvec3(edge[0]), to_dvec3(edge[1])}, p[0], normal, lines);
    }
    std::erase_if(lines, [&](const ContactLine& line) {
      std::array<double, 3> across;
      for (int k = 0; k < 3; ++k) across[k] = snap(line.across(p[k]), settings_.tolerance);
      return line.length() < settings_.shortest || !line.crosses(p, across, settings_.tolerance);
    });
    return lines;
  }

  static double snap(double distance, double tolerance) {
    return std::abs(distance) <= tolerance ? 0 : distance;
  }

  void add_edges(std::uint32_t t, Outline& outline) const {
    for (int k = 0; k < 3; ++k) {
      const Float3& a = scene_.position[scene_.triangle[t][k]];
      const Float3& b = scene_.position[scene_.triangle[t][(k + 1) % 3]];
      ++outline[{std::min(a, b), std::max(a, b)}];
    }
  }

  /// Where the triangle `q` passes through a plane or, failing that, stands close above it.
  std::optional<Segment> meet(const Corners& q, const Heights& height) const {
    const std::optional<Segment> through = meet(q, height, settings_.tolerance);
    return through ? through : meet(q, height, settings_.gap);
  }

  static std::optional<Segment> meet(const Corners& q, Heights height, double tolerance) {
    for (double& h : height) h = snap(h, tolerance);
    std::array<glm::dvec3, 3> end;
    std::size_t count = 0;
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      if (height[k] == 0) end[count++] = q[k];
      if (height[k] * height[next] < 0) {
        end[count++] = glm::mix(q[k], q[next], height[k] / (height[k] - height[next]));
      }
    }
    if (count != 2) return {};  // it is clear of the plane, or touches it with a corner
    return Segment{end[0], end[1]};
  }

  /// Adds a segment, moved into the plane through `origin`, to `lines`.
  void add(Segment segment, const glm::dvec3& origin, const glm::dvec3& normal,
           std::vector<ContactLine>& lines) const {
    for (glm::dvec3& end : segment) end -= glm::dot(end - origin, normal) * normal;
    if (glm::distance(segment[0], segment[1]) <= settings_.tolerance) return;
    merge(ContactLine(segment[0], segment[1], normal), normal, lines);
  }

  /// Adds `line` to `lines`, joined with all those that go on from it.
  void merge(ContactLine line, const glm::dvec3& normal, std::vector<ContactLine>& lines) const {
    for (std::size_t k = 0; k < lines.size();) {
      const auto joined = join(line, lines[k], normal);
      if (!joined) {
        ++k;
        continue;
      }
      line = *joined;
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(k));
      k = 0;
    }
    lines.push_back(line);
  }

  /// Two lines as one, if one goes on where the other ends, or they overlap.
  std::optional<ContactLine> join(const ContactLine& a, const ContactLine& b,
                                  const glm::dvec3& normal) const {
    const ContactLine& longer = a.length() > b.length() ? a : b;
    const ContactLine& shorter = a.length() > b.length() ? b : a;
    const glm::dvec3 begin = shorter.begin(), end = shorter.end();
    const double farthest = std::max(std::abs(longer.across(begin)), std::abs(longer.across(end)));
    if (farthest > kSameLine * settings_.tolerance) return {};
    const auto [low, high] = std::minmax({longer.along(begin), longer.along(end)});
    if (high < -settings_.tolerance || low > longer.length() + settings_.tolerance) return {};
    const glm::dvec3 direction = (longer.end() - longer.begin()) / longer.length();
    return ContactLine(longer.begin() + std::min(low, 0.0) * direction,
                       longer.begin() + std::max(high, longer.length()) * direction, normal);
  }

  const Scene& scene_;
  const ContactSettings& settings_;
  std::vector<std::uint32_t> large_;  ///< triangles that may cut and be cut
  BoxTree tree_;                      ///< over them
};

}  // namespace

ContactLine::ContactLine(const glm::dvec3& begin, const glm::dvec3& end, const glm::dvec3& normal)
    : begin_(begin),
      direction_(glm::normalize(end - begin)),
      across_(glm::cross(normal, direction_)),
      length_(glm::distance(begin, end)) {}

bool ContactLine::crosses(const std::array<glm::dvec3, 3>& corner,
                          const std::array<double, 3>& across, double tolerance) const {
  const auto [lowest, highest] = std::ranges::minmax(across);
  if (lowest >= 0 || highest <= 0) return false;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto reach = [&](const glm::dvec3& point) {
    low = std::min(low, along(point));
    high = std::max(high, along(point));
  };
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (across[k] == 0) reach(corner[k]);
    if (across[k] * across[next] < 0) {
      reach(glm::mix(corner[k], corner[next], across[k] / (across[k] - across[next])));
    }
  }
  return std::min(high, length_) - std::max(low, 0.0) > tolerance;
}

std::vector<Contact> find_contacts(const Scene& scene, const ContactSettings& settings) {
  return ContactFinder(scene, settings).find();
}

}  // namespace rebounce

#include "precompute/patches/contacts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "precompute/sampling/box_tree.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// Lines within this multiple of the tolerance count as one: two lines would leave a strip of
// slivers between them (lab/020).
constexpr double kSameLine = 8;

using Corners = TriangleCorners;
using Heights = std::array<double, 3>;      // of the corners of a triangle above a plane, metres
using Segment = std::array<glm::dvec3, 2>;  // its ends
using Edge = std::array<Float3, 2>;         // its ends, the lower first

double longest_edge(const Corners& p) {
  return std::max(
      {glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
}

/// A triangle whose contacts are searched.
struct Touched {
  std::uint32_t triangle;
  Corners corner;
  glm::dvec3 normal;  ///< unit
  bool both_sides;
};

/// Keeps edges that occur exactly once, and drops all others.
void keep_single(std::vector<Edge>& edges) {
  std::ranges::sort(edges);
  std::size_t kept = 0;
  for (std::size_t k = 0, next = 0; k < edges.size(); k = next) {
    while (next < edges.size() && edges[next] == edges[k]) ++next;
    if (next == k + 1) edges[kept++] = edges[k];
  }
  edges.resize(kept);
}

class ContactFinder {
 public:
  ContactFinder(const Scene& scene, const ContactSettings& settings)
      : scene_(scene),
        settings_(settings),
        width_(kSameLine * settings.tolerance),
        large_(find_large()),
        tree_(make_boxes()) {}

  std::vector<Contact> find() const {
    std::vector<std::vector<ContactLine>> lines(large_.size());
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t k = 0; k < large_.size(); ++k) lines[k] = lines_on(touched(large_[k]));
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
    for (const std::uint32_t t : large_) boxes.push_back(box_of(t, 0));
    return boxes;
  }

  /// The box around a triangle, extended by `margin` metres on each side.
  Box box_of(std::uint32_t t, double margin) const {
    Box box;
    for (const std::uint32_t v : scene_.triangle[t]) box.add(to_glm(scene_.position[v]));
    const glm::vec3 more(static_cast<float>(margin));
    return {box.low - more, box.high + more};
  }

  Touched touched(std::uint32_t t) const {
    const Corners p = corners_of(scene_, t);
    return {t, p, front_normal(p), scene_.materials[scene_.triangle_material[t]].double_sided};
  }

  /// The contacts of a triangle. Far more pieces lie around it, in its plane, than touch it (a
  /// triangle of a thin tube has the whole tube around it). Only pieces that touch make lines, and
  /// only lines that cross the triangle are followed beyond it.
  std::vector<ContactLine> lines_on(const Touched& t) const {
    std::vector<ContactLine> whole;
    for (const ContactLine& line : crossing_lines(pieces_in(prism_around(t), t), t)) {
      std::vector<ContactLine> pieces = pieces_in(strip_around(line, t), t);
      pieces.push_back(line);
      std::ranges::copy(crossing_lines(std::move(pieces), t), std::back_inserter(whole));
    }
    std::vector<ContactLine> lines = crossing_lines(std::move(whole), t);
    std::erase_if(lines, [&](const ContactLine& l) { return l.length() < settings_.shortest; });
    return lines;
  }

  /// Joins pieces to lines and keeps those that cross a triangle.
  std::vector<ContactLine> crossing_lines(std::vector<ContactLine> pieces, const Touched& t) const {
    std::vector<ContactLine> lines = join_lines(std::move(pieces), width_, settings_.tolerance);
    std::erase_if(lines, [&](const ContactLine& line) { return !crosses(line, t); });
    return lines;
  }

  bool crosses(const ContactLine& line, const Touched& t) const {
    std::array<double, 3> across;
    for (int k = 0; k < 3; ++k) across[k] = snap(line.across(t.corner[k]), settings_.tolerance);
    return line.crosses(t.corner, across, settings_.tolerance);
  }

  /// The region above and below a triangle.
  ConvexRegion prism_around(const Touched& t) const {
    ConvexRegion region = {box_of(t.triangle, settings_.gap + width_), {}};
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& begin = t.corner[k];
      const glm::dvec3 outwards =
          glm::normalize(glm::cross(t.corner[(k + 1) % 3] - begin, t.normal));
      region.sides.push_back({outwards, glm::dot(outwards, begin) + width_});
    }
    return region;
  }

  /// The region above and below a line on a triangle, at most the shortest contact beyond the
  /// triangle.
  ConvexRegion strip_around(const ContactLine& line, const Touched& t) const {
    const double reach = settings_.gap + settings_.shortest + width_;
    ConvexRegion region = {box_of(t.triangle, reach), {}};
    for (const glm::dvec3& outwards : {line.across_direction(), -line.across_direction()}) {
      region.sides.push_back({outwards, glm::dot(outwards, line.begin()) + 2 * width_});
    }
    return region;
  }

  /// The part of a region that is near enough to the plane of a triangle, and not entirely behind
  /// it.
  ConvexRegion layer_of(ConvexRegion region, const Touched& t) const {
    const double height = glm::dot(t.normal, t.corner[0]);
    // One tolerance more than the limit that triangles are tested against later.
    const double above = settings_.gap + settings_.tolerance;
    const double below = t.both_sides ? above : 2 * settings_.tolerance;
    region.sides.push_back({t.normal, height + above});
    region.sides.push_back({-t.normal, below - height});
    return region;
  }

  /// Contacts with large triangles, in pieces of this size, as far as they meet a region.
  std::vector<ContactLine> pieces_in(const ConvexRegion& region, const Touched& t) const {
    std::vector<std::uint32_t> near;
    tree_.find(layer_of(region, t), near);
    std::vector<ContactLine> pieces;
    std::vector<Edge> outline;
    for (const std::uint32_t k : near) {
      const std::uint32_t other = large_[k];
      if (other == t.triangle) continue;
      const Corners q = corners_of(scene_, other);
      Heights height;
      for (int c = 0; c < 3; ++c) height[c] = glm::dot(q[c] - t.corner[0], t.normal);
      const auto [lowest, highest] = std::ranges::minmax(height);
      const bool flat = lowest >= -settings_.gap && highest <= settings_.gap;
      const bool behind = highest <= (flat ? -settings_.tolerance : settings_.tolerance);
      if (behind && !t.both_sides) continue;
      if (flat) {
        add_edges(other, region, outline);
      } else if (const auto ends = meet(q, height)) {
        if (region.may_meet((*ends)[0], (*ends)[1])) add(*ends, t, pieces);
      }
    }
    keep_single(outline);
    for (const Edge& edge : outline) add({to_dvec3(edge[0]), to_dvec3(edge[1])}, t, pieces);
    return pieces;
  }

  static double snap(double distance, double tolerance) {
    return std::abs(distance) <= tolerance ? 0 : distance;
  }

  /// Adds the edges in a region. The tree finds every triangle at these edges that is not behind,
  /// so that edges that occur once are outlines.
  void add_edges(std::uint32_t t, const ConvexRegion& region, std::vector<Edge>& edges) const {
    for (int k = 0; k < 3; ++k) {
      const Float3& a = scene_.position[scene_.triangle[t][k]];
      const Float3& b = scene_.position[scene_.triangle[t][(k + 1) % 3]];
      if (region.may_meet(to_glm(a), to_glm(b))) edges.push_back({std::min(a, b), std::max(a, b)});
    }
  }

  /// The segment where the triangle `q` passes through a plane or, otherwise, stands close above
  /// it.
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
    if (count != 2) return {};  // it does not meet the plane, or only with a corner
    return Segment{end[0], end[1]};
  }

  /// Adds a segment to `pieces`, moved into the plane of the triangle.
  void add(Segment segment, const Touched& t, std::vector<ContactLine>& pieces) const {
    for (glm::dvec3& end : segment) end -= glm::dot(end - t.corner[0], t.normal) * t.normal;
    if (glm::distance(segment[0], segment[1]) <= settings_.tolerance) return;
    pieces.emplace_back(segment[0], segment[1], t.normal);
  }

  const Scene& scene_;
  const ContactSettings& settings_;
  double width_;                      ///< largest distance of pieces of one line from it, metres
  std::vector<std::uint32_t> large_;  ///< triangles that may cut and be cut
  BoxTree tree_;                      ///< over them
};

}  // namespace

std::vector<Contact> find_contacts(const Scene& scene, const ContactSettings& settings) {
  return ContactFinder(scene, settings).find();
}

}  // namespace rebounce

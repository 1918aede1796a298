#include "precompute/facets/facets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "rebounce/error.h"

namespace rebounce {
namespace {

// Corners may be off the plane of their facet by this fraction of its size.
constexpr double kFlatness = 1e-3;

// A facet is a line if its area is below this fraction of the square of its size.
constexpr double kNoArea = 1e-12;

// The last triangle of a polygon is turned over if its area is below minus this part of that of the
// others.
constexpr double kTurnedOver = 1e-9;

void check_facet(const Facets& facets, std::size_t facet) {
  const std::span<const std::uint32_t> corners = facets.corners(facet);
  if (corners.size() < 3) refuse_facet(facet, "has fewer than three corners");
  double size = 0;
  for (const std::uint32_t v : corners) {
    if (v >= facets.vertex.size()) {
      refuse_facet(facet, "names vertex " + std::to_string(std::size_t{v} + 1) + " of " +
                              std::to_string(facets.vertex.size()));
    }
    size = std::max(size, glm::distance(facets.vertex[v], facets.vertex[corners[0]]));
  }
  const glm::dvec3 area = facets.vector_area(facet);
  if (!(glm::length(area) > kNoArea * size * size)) refuse_facet(facet, "has no area; remove it");
  const glm::dvec3 normal = glm::normalize(area);
  for (const std::uint32_t v : corners) {
    const double off = std::abs(glm::dot(normal, facets.vertex[v] - facets.vertex[corners[0]]));
    if (off > kFlatness * size) refuse_facet(facet, "is not flat; cut it into triangles");
  }
}

/// Cuts ears off a polygon, the one with the shortest diagonal first.
class EarCutter {
 public:
  EarCutter(std::span<const glm::dvec3> corner, const glm::dvec3& normal)
      : corner_(corner), normal_(normal), left_(corner.size()) {
    std::iota(left_.begin(), left_.end(), 0U);
  }

  std::vector<std::array<std::uint32_t, 3>> cut() {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    double turns = 0;  // of all triangles
    while (left_.size() > 3) {
      const std::size_t ear = shortest_ear();
      if (ear == left_.size()) return {};
      triangles.push_back({before(ear), left_[ear], after(ear)});
      turns += turn(before(ear), left_[ear], after(ear));
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    if (turn(left_[0], left_[1], left_[2]) < -kTurnedOver * turns) return {};
    triangles.push_back({left_[0], left_[1], left_[2]});
    return triangles;
  }

 private:
  std::uint32_t before(std::size_t k) const { return left_[(k + left_.size() - 1) % left_.size()]; }
  std::uint32_t after(std::size_t k) const { return left_[(k + 1) % left_.size()]; }

  /// Twice the signed area of a triangle.
  double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return glm::dot(normal_, glm::cross(corner_[b] - corner_[a], corner_[c] - corner_[a]));
  }

  bool is_ear(std::size_t k) const {
    const std::uint32_t a = before(k), b = left_[k], c = after(k);
    if (!(turn(a, b, c) > 0)) return false;
    return std::ranges::none_of(left_, [&](std::uint32_t p) {
      return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 &&
             turn(c, a, p) >= 0;
    });
  }

  std::size_t shortest_ear() const {
    std::size_t best = left_.size();
    double shortest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < left_.size(); ++k) {
      const double diagonal = glm::distance(corner_[before(k)], corner_[after(k)]);
      if (diagonal < shortest && is_ear(k)) {
        shortest = diagonal;
        best = k;
      }
    }
    return best;
  }

  std::span<const glm::dvec3> corner_;
  glm::dvec3 normal_;
  std::vector<std::uint32_t> left_;
};

}  // namespace

glm::dvec3 Facets::vector_area(std::size_t facet) const {
  const std::span<const std::uint32_t> index = corners(facet);
  const glm::dvec3& origin = vertex[index[0]];
  glm::dvec3 sum(0);
  for (std::size_t k = 2; k < index.size(); ++k) {
    sum += glm::cross(vertex[index[k - 1]] - origin, vertex[index[k]] - origin);
  }
  return 0.5 * sum;
}

void refuse_facet(std::size_t facet, const std::string& reason) {
  throw Error("facet " + std::to_string(facet + 1) + " " + reason);
}

void check_facets(const Facets& facets) {
  for (std::size_t v = 0; v < facets.vertex.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(facets.vertex[v][axis])) {
        throw Error("vertex " + std::to_string(v + 1) + " is not finite");
      }
    }
  }
  bool any = false;
  for (std::size_t k = 0; k < facets.size(); ++k) {
    check_facet(facets, k);
    any = any || facets.exchanges(k);
  }
  if (!any) throw Error("there are no facets that exchange light");
}

std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const glm::dvec3> corner,
                                                      const glm::dvec3& normal) {
  return EarCutter(corner, normal).cut();
}

}  // namespace rebounce

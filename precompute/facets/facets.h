#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

namespace rebounce {

/// Flat polygons as a caller gives them. Facet k has corners
/// [corner_begin[k], corner_begin[k + 1]), counter-clockwise from its front, the one side that
/// exchanges light. Its back stops light. Facets may be concave, without holes.
struct Facets {
  std::vector<glm::dvec3> vertex;                 ///< [v] any unit of length
  std::vector<std::uint32_t> corner_begin = {0};  ///< [n + 1]
  std::vector<std::uint32_t> corner;              ///< vertex indices
  /// [n] or empty: 1 for a facet that only stops light, on both sides.
  std::vector<std::uint8_t> obstructs_only;
  /// [n] in [0, 1], or empty: not known. Only exchange factors need it.
  std::vector<double> emissivity;

  std::size_t size() const { return corner_begin.size() - 1; }
  std::span<const std::uint32_t> corners(std::size_t facet) const {
    return std::span(corner).subspan(corner_begin[facet],
                                     corner_begin[facet + 1] - corner_begin[facet]);
  }
  bool exchanges(std::size_t facet) const {
    return obstructs_only.empty() || obstructs_only[facet] == 0;
  }

  void add(std::span<const std::uint32_t> corners) {
    corner.insert(corner.end(), corners.begin(), corners.end());
    corner_begin.push_back(static_cast<std::uint32_t>(corner.size()));
  }

  /// Half the sum of the cross products of the corners: along the normal, as long as the area.
  glm::dvec3 vector_area(std::size_t facet) const;
};

/// Throws Error, with the number of the facet (from 1), if a vertex is not finite or not there, or
/// a facet has fewer than three corners, no area, or corners that are off its plane by more than a
/// thousandth of its size; or if there is no facet.
void check_facets(const Facets& facets);

/// Throws Error: facet `facet` (from 0; the message counts from 1), and what is wrong with it.
[[noreturn]] void refuse_facet(std::size_t facet, const std::string& reason);

/// The corners of a flat polygon as triangles, three indices of `corner` each, counter-clockwise as
/// the polygon is. The shortest diagonals are cut first, for triangles that are not thin. Empty if
/// the polygon crosses itself.
std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const glm::dvec3> corner,
                                                      const glm::dvec3& normal);

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <vector>

#include "precompute/import/scene.h"
#include "precompute/patches/contact_line.h"

namespace rebounce {

struct Contact {
  std::uint32_t triangle;
  ContactLine line;  ///< may extend beyond the triangle
};

struct ContactSettings {
  /// Metres: contacts shorter than this, and triangles without such an edge, do not count.
  double shortest;
  double tolerance;  ///< metres: points closer than this count as equal
  double gap;        ///< metres: a surface less than this above a triangle stands on it
};

/// Finds the contacts of every triangle, in the order of the triangles: the lines where others pass
/// through it, where they have an edge in its plane (a wall that stands on a floor), and the
/// outlines of surfaces that lie flat on it (a rug, a lamp under a ceiling). Pieces in one line
/// make one contact. Surfaces entirely behind a one-sided triangle make none.
std::vector<Contact> find_contacts(const Scene& scene, const ContactSettings& settings);

}  // namespace rebounce

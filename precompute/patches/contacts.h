#pragma once

#include <cstdint>
#include <vector>

#include "precompute/import/scene.h"
#include "precompute/patches/contact_line.h"

namespace rebounce {

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

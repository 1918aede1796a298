// Bisection: longest_edges.h. Moving vertices onto the line before edges are cut: F. Labelle and J.
// R. Shewchuk, "Isosurface stuffing" (2007), there in three dimensions.

#include "precompute/patches/contact_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "precompute/patches/conforming_mesh.h"
#include "precompute/patches/contacts.h"
#include "precompute/patches/longest_edges.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// All in units of the patch size, the square root of the area of a patch.
constexpr double kShortestContact = 0.5;
constexpr double kTolerance = 1.0 / 1024;  // far below what a patch resolves
constexpr double kGap = 1.0 / 2;           // light through a smaller gap does not reach far

// The tolerance is at least this fraction of the largest coordinate, some tens of its rounding
// errors: a vertex that is moved onto a line must count as lying on it.
constexpr double kRounding = 1.0 / (1 << 18);

// A cut that passes an end of an edge at less than this fraction of the edge moves that end
// instead.
constexpr double kSnap = 0.2;

// Such a move must leave at least this fraction of the area of a triangle.
constexpr double kLeastArea = 0.4;

double largest_coordinate(const Scene& scene) {
  double largest = 0;
  for (const auto& [x, y, z] : scene.position) {
    largest = std::max<double>({largest, std::abs(x), std::abs(y), std::abs(z)});
  }
  return largest;
}

class ContactCuts {
 public:
  ContactCuts(Scene& scene, std::vector<Contact> contacts, double patch_size, double tolerance)
      : scene_(scene),
        mesh_(scene),
        contacts_(std::move(contacts)),
        is_free_(scene.position.size(), false),
        patch_size_(patch_size),
        tolerance_(tolerance) {
    for (const Contact& contact : contacts_) pieces_[contact.triangle] = {contact.triangle};
    std::ranges::stable_sort(contacts_, [](const Contact& a, const Contact& b) {
      return a.line.length() > b.line.length();
    });
  }

  /// Cuts at the longest contacts first, until cuts have added `most_added` triangles. Bisection
  /// does not count: subdivision would do the same.
  void run(std::size_t most_added) {
    for (const Contact& contact : contacts_) refine(contact);
    const std::size_t most = mesh_.triangle_count() + most_added;
    std::size_t count = 0;
    while (count < contacts_.size() && mesh_.triangle_count() < most) cut(contacts_[count++]);
    // A vertex that was moved for one contact may have brought a triangle under the end of another.
    bool changed = count > 0;
    while (changed) {
      changed = false;
      for (const Contact& contact : std::span(contacts_).first(count)) changed |= cut(contact);
    }
    mesh_.finish();
  }

 private:
  using EdgeKey = ConformingMesh::EdgeKey;

  const std::vector<std::uint32_t>& pieces_of(const Contact& contact) const {
    return pieces_.at(contact.triangle);
  }

  /// Bisects the pieces that a contact crosses until they are as small as patches.
  void refine(const Contact& contact) {
    const std::vector<std::uint32_t>& pieces = pieces_of(contact);
    const double longest = kLongestEdge * patch_size_;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      while (mesh_.length_squared(longest_edge(mesh_, pieces[k])) > longest * longest &&
             is_crossed(pieces[k], contact.line)) {
        bisect(pieces[k]);
      }
    }
  }

  /// Bisects the longest edge of a triangle, but first that of a neighbour with a longer one.
  void bisect(std::uint32_t t) {
    const EdgeKey wanted = longest_edge(mesh_, t);
    EdgeKey key = wanted;
    do {
      key = end_of_longest_edge_path(mesh_, wanted);
      split(key, 0.5);
    } while (key != wanted);
  }

  /// Makes a contact an edge of the mesh. Returns true if the mesh changed.
  bool cut(const Contact& contact) {
    const std::vector<std::uint32_t>& pieces = pieces_of(contact);
    bool changed = false;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      while (is_crossed(pieces[k], contact.line)) {
        cut_piece(pieces[k], contact);
        changed = true;
      }
    }
    hold_vertices_on(contact);
    return changed;
  }

  /// Prevents vertices on a contact from being moved off it by another contact.
  void hold_vertices_on(const Contact& contact) {
    for (const std::uint32_t t : pieces_of(contact)) {
      for (const std::uint32_t v : scene_.triangle[t]) {
        if (std::abs(contact.line.across(position(v))) <= tolerance_) is_free_[v] = false;
      }
    }
  }

  /// Does one step towards a piece that the contact does not cross.
  void cut_piece(std::uint32_t t, const Contact& contact) {
    const std::array<double, 3> across = distances(t, contact.line);
    int corner = 0;
    while (across[corner] * across[(corner + 1) % 3] >= 0) ++corner;
    const std::uint32_t a = scene_.triangle[t][corner], b = scene_.triangle[t][(corner + 1) % 3];
    const double part = across[corner] / (across[corner] - across[(corner + 1) % 3]);
    if (part < kSnap && try_move(a, b, part, contact)) return;
    if (1 - part < kSnap && try_move(b, a, 1 - part, contact)) return;
    const EdgeKey key = mesh_.edge(t, corner);
    split(key, mesh_.is_begin(key, a) ? part : 1 - part);
    is_free_.back() = false;
  }

  /// Moves vertex `v` towards `to`, if it is free to move and no triangle loses too much area.
  bool try_move(std::uint32_t v, std::uint32_t to, double part, const Contact& contact) {
    if (!is_free_[v]) return false;
    is_free_[v] = false;
    const glm::dvec3 target = glm::mix(position(v), position(to), part);
    for (const std::uint32_t t : pieces_of(contact)) {
      const Uint3& corner = scene_.triangle[t];
      const auto k = std::ranges::find(corner, v) - corner.begin();
      if (k == 3) continue;
      const glm::dvec3 p = position(corner[(k + 1) % 3]), q = position(corner[(k + 2) % 3]);
      const glm::dvec3 before = glm::cross(p - position(v), q - position(v));
      const glm::dvec3 after = glm::cross(p - target, q - target);
      if (glm::dot(before, after) < kLeastArea * glm::dot(before, before)) return false;
    }
    mesh_.move_vertex(v, to, part);
    return true;
  }

  void split(EdgeKey key, double part) {
    const ConformingMesh::EdgeSplit split = mesh_.split_edge(key, part);
    const std::uint32_t source = mesh_.source(split.triangles.front().kept);
    bool one_source = true;
    for (const auto& [kept, added] : split.triangles) {
      one_source = one_source && mesh_.source(kept) == source;
      const auto found = pieces_.find(mesh_.source(kept));
      if (found != pieces_.end()) found->second.push_back(added);
    }
    is_free_.resize(scene_.position.size(), one_source && split.triangles.size() == 2);
  }

  glm::dvec3 position(std::uint32_t v) const { return to_dvec3(scene_.position[v]); }

  /// Distances of the corners of a triangle from a contact, 0 for corners that count as lying on
  /// it. Free vertices do not: they can be moved onto it.
  std::array<double, 3> distances(std::uint32_t t, const ContactLine& line) const {
    std::array<double, 3> across;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = scene_.triangle[t][k];
      across[k] = line.across(position(v));
      if (!is_free_[v] && std::abs(across[k]) <= tolerance_) across[k] = 0;
    }
    return across;
  }

  bool is_crossed(std::uint32_t t, const ContactLine& line) const {
    const Uint3& v = scene_.triangle[t];
    return line.crosses({position(v[0]), position(v[1]), position(v[2])}, distances(t, line),
                        tolerance_);
  }

  Scene& scene_;
  ConformingMesh mesh_;
  std::vector<Contact> contacts_;  ///< longest first
  /// The pieces of each triangle with contacts.
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> pieces_;
  std::vector<bool> is_free_;      ///< vertices inside a triangle that lie on no contact yet
  double patch_size_, tolerance_;  ///< metres
};

}  // namespace

void cut_at_contacts(Scene& scene, const SubdivisionSettings& settings) {
  const std::vector<std::uint8_t> one_each(scene.triangle.size(), 1);
  const double scene_size = mean_patch_size(scene, one_each, 1);
  const double mean = scene_size / std::sqrt(static_cast<double>(settings.patch_count));
  const double patch_size =
      std::max(settings.patch_size / kLongestEdge, settings.patch_count > 0 ? mean : 0.0);
  if (patch_size == 0) return;
  const double tolerance = std::max(kTolerance * patch_size, kRounding * largest_coordinate(scene));
  std::vector<Contact> contacts =
      find_contacts(scene, {.shortest = kShortestContact * patch_size,
                            .tolerance = tolerance,
                            .gap = std::max(kGap * patch_size, tolerance)});
  if (contacts.empty()) return;
  const double wanted_patches = std::pow(scene_size / patch_size, 2);
  ContactCuts(scene, std::move(contacts), patch_size, tolerance)
      .run(static_cast<std::size_t>(wanted_patches / 2));
}

}  // namespace rebounce

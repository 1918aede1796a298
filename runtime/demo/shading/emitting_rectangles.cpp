#include "runtime/demo/shading/emitting_rectangles.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <tuple>

#include "runtime/demo/image/srgb.h"
#include "runtime/lights/emitting_material.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"
#include "transfer/base/disjoint_sets.h"

namespace rebounce {
namespace {

// How far a rectangle may be off: its corners in parts of its size, its area, its light.
constexpr double kTolerance = 1e-3;

using Triangles = std::vector<std::uint32_t>;

struct Plane {
  glm::dvec3 middle{0};  ///< of the surface
  glm::dvec3 normal{0};  ///< unit
  double area = 0;
};

/// Triangles of an even luminance, in pieces that hang together and have one material and one side.
std::vector<Triangles> even_pieces(const TransferData& data) {
  const DisplayMesh& mesh = data.mesh;
  Triangles emitting;
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const std::uint32_t patch = mesh.triangle_patch[t];
    if (patch == kNone || !emits(data.patches, patch)) continue;
    const Material& material = data.materials[mesh.triangle_material[t]];
    const bool is_even = material.emissive_texture == kNone && mesh.opacity.of_triangle(t).empty();
    if (is_even) emitting.push_back(t);
  }
  DisjointSets sets(emitting.size());
  std::map<std::tuple<Float3, bool, std::uint32_t>, std::uint32_t> first_at;
  for (std::uint32_t k = 0; k < emitting.size(); ++k) {
    const std::uint32_t t = emitting[k];
    for (const std::uint32_t v : mesh.triangle[t]) {
      const bool is_back = t >= mesh.surface_count();
      const auto [found, is_new] =
          first_at.try_emplace({mesh.position[v], is_back, mesh.triangle_material[t]}, k);
      if (!is_new) sets.join(k, found->second);
    }
  }
  std::map<std::uint32_t, Triangles> pieces;
  for (std::uint32_t k = 0; k < emitting.size(); ++k) pieces[sets.find(k)].push_back(emitting[k]);
  std::vector<Triangles> list;
  for (auto& [set, triangles] : pieces) list.push_back(std::move(triangles));
  return list;
}

Plane plane_of(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles) {
  Plane plane;
  for (const std::uint32_t t : triangles) {
    const TriangleCorners corners = corners_of(mesh, t);
    const double area = area_of(corners);
    plane.area += area;
    plane.normal += area_vector(corners);
    plane.middle += area * (corners[0] + corners[1] + corners[2]) / 3.0;
  }
  plane.middle /= plane.area;
  plane.normal = glm::normalize(plane.normal);
  return plane;
}

/// The rectangle that triangles of the exitance `exitance` cover, or nothing.
std::optional<Light> rectangle_of(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles,
                                  const Float3& exitance) {
  const Plane plane = plane_of(mesh, triangles);
  const double near = kTolerance * std::sqrt(plane.area);
  const auto farthest = [&](const auto& distance) {
    glm::dvec3 best(0);
    for (const std::uint32_t t : triangles) {
      for (const glm::dvec3& corner : corners_of(mesh, t)) {
        const glm::dvec3 way = corner - plane.middle;
        if (distance(way) > distance(best)) best = way;
      }
    }
    return best;
  };
  // Two corners that are not opposite ones.
  const glm::dvec3 p = farthest([](const glm::dvec3& way) { return glm::length(way); });
  const glm::dvec3 q =
      farthest([&](const glm::dvec3& way) { return glm::length(glm::cross(p, way)); });
  const glm::dvec3 off =
      farthest([&](const glm::dvec3& way) { return std::abs(glm::dot(plane.normal, way)); });
  const double width = glm::length(p + q), height = glm::length(p - q);
  const bool is_flat = std::abs(glm::dot(plane.normal, off)) < near;
  const bool is_right = std::abs(glm::length(p) - glm::length(q)) < near;
  const bool is_filled = std::abs(width * height - plane.area) < kTolerance * plane.area;
  if (!is_flat || !is_right || !is_filled) return std::nullopt;
  Light lamp;
  lamp.type = LightType::kRectangle;
  // In front of the surface, which would shade a lamp that lies in it.
  lamp.position = to_float3(glm::vec3(plane.middle + near * plane.normal));
  lamp.direction = to_float3(glm::vec3(plane.normal));
  lamp.color = to_float3(to_glm(exitance) / std::ranges::max(exitance));
  lamp.intensity = std::ranges::max(exitance) / std::numbers::pi_v<float>;
  lamp.size = {static_cast<float>(width), static_cast<float>(height)};
  lamp.tangent = to_float3(glm::vec3((p + q) / width));
  return lamp;
}

/// Whether the patches of these triangles have no others.
bool are_whole_patches(const TransferData& data, std::span<const std::uint32_t> triangles) {
  double shown = 0, whole = 0;
  std::set<std::uint32_t> patches;
  for (const std::uint32_t t : triangles) {
    shown += area_of(corners_of(data.mesh, t));
    patches.insert(data.mesh.triangle_patch[t]);
  }
  for (const std::uint32_t patch : patches) whole += static_cast<double>(data.patches.area[patch]);
  return std::abs(whole - shown) < kTolerance * shown;
}

double lumens_of(const Light& lamp) {
  return luminance(to_glm(lamp.color)) * lamp.intensity * lamp.size[0] * lamp.size[1];
}

}  // namespace

bool EmittingRectangles::leave_any(const TransferData& data) const {
  for (std::uint32_t p = 0; p < is_lamp.size(); ++p) {
    if (emits(data.patches, p) && !is_lamp[p]) return true;
  }
  return false;
}

EmittingRectangles find_emitting_rectangles(const TransferData& data, std::size_t most) {
  const DisplayMesh& mesh = data.mesh;
  std::vector<std::pair<Light, Triangles>> found;
  for (Triangles& piece : even_pieces(data)) {
    const Float3& exitance = data.patches.emitted_exitance[mesh.triangle_patch[piece.front()]];
    const auto is_other = [&](std::uint32_t t) {
      const glm::vec3 own = to_glm(data.patches.emitted_exitance[mesh.triangle_patch[t]]);
      const float difference = glm::length(own - to_glm(exitance));
      return difference > static_cast<float>(kTolerance) * glm::length(to_glm(exitance));
    };
    if (std::ranges::any_of(piece, is_other) || !are_whole_patches(data, piece)) continue;
    std::optional<Light> lamp = rectangle_of(mesh, piece, exitance);
    if (lamp) found.emplace_back(std::move(*lamp), std::move(piece));
  }
  std::ranges::stable_sort(found, std::greater(),
                           [](const auto& one) { return lumens_of(one.first); });
  found.resize(std::min(found.size(), most));
  EmittingRectangles result{.lamps = {}, .is_lamp = std::vector<bool>(data.patches.size(), false)};
  for (auto& [lamp, triangles] : found) {
    for (const std::uint32_t t : triangles) result.is_lamp[mesh.triangle_patch[t]] = true;
    result.lamps.push_back(std::move(lamp));
  }
  return result;
}

}  // namespace rebounce

#include "precompute/outputs/row_receivers.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// A vertex gets no row if its share of the surface is more than this part of a patch (lab/118).
constexpr double kLargestShare = 0.5;

// How far places of texels are drawn to the middle of their triangle: at an edge from which a wall
// rises, half of what a point sees would lie behind the wall (lab/127).
constexpr double kInwards = 1.0 / 256;

void add(const Float3& position, const Float3& normal, double share, std::uint32_t receiver,
         RowReceivers::Candidates& to) {
  to.receiver.push_back(receiver);
  to.share.push_back(share);
  to.place.area.push_back(1);
  to.place.centroid.push_back(position);
  to.place.normal.push_back(normal);
}

bool has_weights(const DisplayMesh& mesh, std::uint32_t vertex) {
  return mesh.weight_begin[vertex] < mesh.weight_begin[vertex + 1];
}

/// Adds the weights of a vertex times `part`.
void add_weights(const DisplayMesh& mesh, std::uint32_t vertex, float part, ViewRow& weights) {
  for (std::uint32_t k = mesh.weight_begin[vertex]; k < mesh.weight_begin[vertex + 1]; ++k) {
    weights.push_back({mesh.weight_patch[k], part * mesh.weight[k]});
  }
}

}  // namespace

SmallVertices::SmallVertices(const DisplayMesh& mesh, const PatchTable& patches,
                             std::span<const std::uint32_t> shown_patch)
    : mesh_(mesh),
      patches_(patches),
      shown_patch_(shown_patch),
      triangles_(mesh.position.size(), [&](const auto& give) {
        for (std::uint32_t t = 0; t < shown_patch.size(); ++t) {
          if (shown_patch[t] == kNone) continue;
          for (const std::uint32_t v : mesh.triangle[t]) give(v, t);
        }
      }) {}

std::optional<double> SmallVertices::share(std::uint32_t vertex) const {
  double area = 0, of_patches = 0;
  for (const std::uint32_t t : triangles_[vertex]) {
    const double size = area_of(corners_of(mesh_, t));
    area += size;
    of_patches += size * static_cast<double>(patches_.area[shown_patch_[t]]);
  }
  const double share = area / 3;  // the integral of the hat function
  if (share * area < kLargestShare * of_patches) return share;
  return std::nullopt;
}

double SmallVertices::part_of_surface() const {
  double small = 0, whole = 0;
  for (std::uint32_t v = 0; v < mesh_.position.size(); ++v) small += share(v).value_or(0);
  for (std::uint32_t t = 0; t < shown_patch_.size(); ++t) {
    if (shown_patch_[t] != kNone) whole += area_of(corners_of(mesh_, t));
  }
  return whole > 0 ? small / whole : 0;
}

VertexReceivers::VertexReceivers(const TransferData& data,
                                 std::span<const std::uint32_t> shown_patch)
    : data_(data), small_(data.mesh, data.patches, shown_patch) {}

RowReceivers::Candidates VertexReceivers::candidates() const {
  const DisplayMesh& mesh = data_.mesh;
  Candidates found;
  for (std::uint32_t v = 0; v < mesh.position.size(); ++v) {
    if (!has_weights(mesh, v)) continue;
    const std::optional<double> share = small_.share(v);
    if (share) add(mesh.position[v], mesh.normal[v], *share, v, found);
  }
  return found;
}

void VertexReceivers::look(std::uint32_t receiver, double sight, ReceiverViewer& viewer,
                           ViewRow& row) const {
  viewer.look_from_vertex(receiver, small_.triangles(receiver), sight, row);
}

void VertexReceivers::find_weights(std::uint32_t receiver, ViewRow& weights) const {
  weights.clear();
  add_weights(data_.mesh, receiver, 1, weights);
}

TexelReceivers::TexelReceivers(const TransferData& data, std::span<const std::uint32_t> shown_patch)
    : data_(data), shown_patch_(shown_patch) {}

TexelReceivers::Place TexelReceivers::place_of(std::uint32_t texel) const {
  const std::uint32_t t = data_.lightmap.triangle[texel];
  const glm::dvec2 inside =
      glm::max(glm::dvec2(to_glm(data_.lightmap.weight[texel])), glm::dvec2(0));
  const glm::dvec2 kept =
      glm::mix(inside / std::max(1.0, inside.x + inside.y), glm::dvec2(1.0 / 3), kInwards);
  const glm::dvec3 part(1 - kept.x - kept.y, kept.x, kept.y);
  const TriangleCorners p = corners_of(data_.mesh, t);
  const glm::dvec3 front = front_normal(p);
  const auto& [a, b, c] = data_.mesh.triangle[t];
  const auto normal_at = [&](std::uint32_t v) { return to_dvec3(data_.mesh.normal[v]); };
  const glm::dvec3 smooth = part.x * normal_at(a) + part.y * normal_at(b) + part.z * normal_at(c);
  const double length = glm::length(smooth);
  const glm::dvec3 shading = glm::dot(smooth, front) > 0 ? smooth / length : front;
  return {{to_float3(part.x * p[0] + part.y * p[1] + part.z * p[2]), to_float3(front)},
          to_float3(shading)};
}

RowReceivers::Candidates TexelReceivers::candidates() const {
  Candidates found;
  for (std::uint32_t k = 0; k < data_.lightmap.triangle.size(); ++k) {
    const std::uint32_t t = data_.lightmap.triangle[k];
    if (t == kNone || shown_patch_[t] == kNone) continue;
    if (!(area_of(corners_of(data_.mesh, t)) > 0)) continue;
    const bool lit = std::ranges::any_of(
        data_.mesh.triangle[t], [&](std::uint32_t v) { return has_weights(data_.mesh, v); });
    if (!lit) continue;
    const Place place = place_of(k);
    add(place.point.position, place.shading_normal, 1, k, found);
  }
  // Texels are about as large as each other.
  double surface = 0;
  for (std::uint32_t t = 0; t < shown_patch_.size(); ++t) {
    if (shown_patch_[t] != kNone) surface += area_of(corners_of(data_.mesh, t));
  }
  std::ranges::fill(found.share, surface / static_cast<double>(found.share.size()));
  return found;
}

void TexelReceivers::look(std::uint32_t receiver, double /*sight*/, ReceiverViewer& viewer,
                          ViewRow& row) const {
  const Place place = place_of(receiver);
  viewer.look_from_point(place.point, place.shading_normal, row);
}

void TexelReceivers::find_weights(std::uint32_t receiver, ViewRow& weights) const {
  weights.clear();
  const auto [second, third] = data_.lightmap.weight[receiver];
  const auto& [a, b, c] = data_.mesh.triangle[data_.lightmap.triangle[receiver]];
  add_weights(data_.mesh, a, 1 - second - third, weights);
  add_weights(data_.mesh, b, second, weights);
  add_weights(data_.mesh, c, third, weights);
  std::ranges::sort(weights, {}, &ViewEntry::patch);
  std::size_t count = 0;
  for (const ViewEntry& entry : weights) {
    if (count > 0 && weights[count - 1].patch == entry.patch) {
      weights[count - 1].part += entry.part;
    } else {
      weights[count++] = entry;
    }
  }
  weights.resize(count);
}

}  // namespace rebounce

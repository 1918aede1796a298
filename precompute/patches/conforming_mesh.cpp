#include "precompute/patches/conforming_mesh.h"

#include <algorithm>
#include <cassert>
#include <glm/glm.hpp>
#include <map>
#include <utility>

#include "precompute/patches/welded_positions.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

template <std::size_t N>
std::array<float, N> mix(const std::array<float, N>& a, const std::array<float, N>& b,
                         double part) {
  std::array<float, N> mixed;
  for (std::size_t k = 0; k < N; ++k) {
    mixed[k] = static_cast<float>((1 - part) * a[k] + part * b[k]);
  }
  return mixed;
}

// Both belong to one triangle, hence to one page.
LightmapTexcoord mix(const LightmapTexcoord& a, const LightmapTexcoord& b, double part) {
  return {mix(a.texcoord, b.texcoord, part), a.page};
}

Float3 mix_normals(const Float3& a, const Float3& b, double part) {
  const glm::vec3 normal = to_glm(mix(a, b, part));
  const float length = glm::length(normal);
  return length > 1e-6F ? to_float3(normal / length) : a;
}

}  // namespace

ConformingMesh::ConformingMesh(Scene& scene) : scene_(scene) {
  WeldedPositions welded = weld_positions(scene.position);
  position_id_ = std::move(welded.id);
  position_count_ = welded.count;
  check_triangle_count(scene.triangle.size());
  const auto count = static_cast<std::uint32_t>(scene.triangle.size());
  source_.resize(count);
  next_.resize(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    source_[t] = t;
    next_[t] = t + 1 < count ? t + 1 : kNone;
  }
  first_edges_ = EdgeTable(count, position_count_, [&](std::uint32_t t) {
    const auto& [a, b, c] = scene.triangle[t];
    return Uint3{position_id_[a], position_id_[b], position_id_[c]};
  });
}

ConformingMesh::EdgeKey ConformingMesh::edge(std::uint32_t t, int corner) const {
  const Uint3& v = scene_.triangle[t];
  const auto [low, high] = std::minmax(position_id_[v[corner]], position_id_[v[(corner + 1) % 3]]);
  return (static_cast<EdgeKey>(low) << 32) | high;
}

float ConformingMesh::length_squared(EdgeKey key) const {
  const std::uint32_t t = triangles(key).front().triangle();
  int corner = 0;
  while (edge(t, corner) != key) ++corner;
  const Uint3& v = scene_.triangle[t];
  const glm::vec3 d =
      to_glm(scene_.position[v[corner]]) - to_glm(scene_.position[v[(corner + 1) % 3]]);
  return glm::dot(d, d);
}

std::span<HalfEdge> ConformingMesh::half_edges(EdgeKey key) {
  if (first_edges_.has_end(high_end(key))) return first_edges_.find(low_end(key), high_end(key));
  return new_edges_.at(key);
}

std::span<const HalfEdge> ConformingMesh::triangles(EdgeKey key) const {
  return const_cast<ConformingMesh*>(this)->half_edges(key);
}

void ConformingMesh::attach_edge(std::uint32_t t, int corner, std::vector<EdgeKey>& new_edges) {
  const EdgeKey key = edge(t, corner);
  std::vector<HalfEdge>& triangles = new_edges_[key];
  if (triangles.empty()) new_edges.push_back(key);
  const bool ascends = position_id_[scene_.triangle[t][corner]] == low_end(key);
  triangles.emplace_back(high_end(key), t, ascends);
}

ConformingMesh::EdgeSplit ConformingMesh::split_edge(EdgeKey key, double part) {
  assert(part > 0 && part < 1);
  const std::span<const HalfEdge> shared = triangles(key);
  const std::vector<HalfEdge> around(shared.begin(), shared.end());
  new_edges_.erase(key);
  const std::uint32_t id = position_count_++;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> new_vertex;
  EdgeSplit split;
  for (const HalfEdge& half_edge : around) {
    const std::uint32_t t = half_edge.triangle();
    int corner = 0;
    while (edge(t, corner) != key) ++corner;
    std::uint32_t a = scene_.triangle[t][corner], b = scene_.triangle[t][(corner + 1) % 3];
    if (!is_begin(key, a)) std::swap(a, b);
    const auto [entry, is_new] = new_vertex.try_emplace({a, b}, kNone);
    if (is_new) entry->second = add_vertex(a, b, part, id);
    split.triangles.push_back({t, split_triangle(t, corner, entry->second, split.new_edges)});
  }
  return split;
}

/// Triangle t = (a, b, c), counted from `corner`, becomes (a, m, c); a new one is (m, b, c).
std::uint32_t ConformingMesh::split_triangle(std::uint32_t t, int corner, std::uint32_t middle,
                                             std::vector<EdgeKey>& new_edges) {
  const Uint3 old = scene_.triangle[t];
  const std::uint32_t a = old[corner], b = old[(corner + 1) % 3], c = old[(corner + 2) % 3];
  const std::span<HalfEdge> bc = half_edges(edge(t, (corner + 1) % 3));
  const auto added = triangle_count();
  check_triangle_count(std::size_t{added} + 1);
  scene_.triangle[t] = {a, middle, c};
  scene_.triangle.push_back({middle, b, c});
  scene_.triangle_material.push_back(scene_.triangle_material[t]);
  source_.push_back(source_[t]);
  next_.push_back(next_[t]);
  next_[t] = added;

  std::ranges::find(bc, t, &HalfEdge::triangle)->set_triangle(added);
  attach_edge(t, 0, new_edges);      // a, m
  attach_edge(t, 1, new_edges);      // m, c
  attach_edge(added, 0, new_edges);  // m, b
  attach_edge(added, 2, new_edges);  // c, m
  return added;
}

std::uint32_t ConformingMesh::add_vertex(std::uint32_t a, std::uint32_t b, double part,
                                         std::uint32_t id) {
  const auto interpolate = [&](auto& values) { values.push_back(mix(values[a], values[b], part)); };
  interpolate(scene_.position);
  interpolate(scene_.base_color_texcoord);
  interpolate(scene_.emissive_texcoord);
  interpolate(scene_.vertex_color);
  scene_.normal.push_back(mix_normals(scene_.normal[a], scene_.normal[b], part));
  if (!scene_.lightmap_texcoord.empty()) {
    scene_.lightmap_texcoord.push_back(
        mix(scene_.lightmap_texcoord[a], scene_.lightmap_texcoord[b], part));
  }
  position_id_.push_back(id);
  return static_cast<std::uint32_t>(scene_.position.size() - 1);
}

void ConformingMesh::move_vertex(std::uint32_t v, std::uint32_t to, double part) {
  const auto move = [&](auto& values) { values[v] = mix(values[v], values[to], part); };
  move(scene_.position);
  move(scene_.base_color_texcoord);
  move(scene_.emissive_texcoord);
  move(scene_.vertex_color);
  scene_.normal[v] = mix_normals(scene_.normal[v], scene_.normal[to], part);
  if (!scene_.lightmap_texcoord.empty()) move(scene_.lightmap_texcoord);
}

std::vector<std::uint32_t> ConformingMesh::finish() {
  std::vector<Uint3> triangle;
  std::vector<std::uint32_t> material, source, mesh;
  for (std::uint32_t t = source_.empty() ? kNone : 0; t != kNone; t = next_[t]) {
    triangle.push_back(scene_.triangle[t]);
    material.push_back(scene_.triangle_material[t]);
    source.push_back(source_[t]);
    if (!scene_.triangle_mesh.empty()) mesh.push_back(scene_.triangle_mesh[source_[t]]);
  }
  scene_.triangle = std::move(triangle);
  scene_.triangle_material = std::move(material);
  scene_.triangle_mesh = std::move(mesh);
  return source;
}

}  // namespace rebounce

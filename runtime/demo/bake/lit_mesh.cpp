#include "runtime/demo/bake/lit_mesh.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "rebounce/error.h"
#include "runtime/demo/bake/lit_surface.h"
#include "runtime/demo/bake/lit_texture.h"
#include "runtime/demo/bake/subdivided_mesh.h"
#include "runtime/demo/image/exposure.h"
#include "runtime/demo/image/pixel_hash.h"
#include "runtime/demo/image/tone_curve.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

constexpr int kMaxDivisions = 64;
constexpr float kBrightestVertex =
    1e6F;  // relative to the screen's white: white with any tone curve
constexpr std::uint32_t kVertexBlock = 256;  // vertices that a thread lights at a time

// The triangles around each vertex, and running sums of their areas.
class Surroundings {
 public:
  // A corner of a triangle at a vertex.
  struct Corner {
    std::uint32_t triangle = 0;
    std::uint32_t index = 0;  // 0 to 2
    double area_end = 0;      // area of this triangle and those before it
  };

  Surroundings(const SubdividedMesh& mesh, std::span<const Float3> position)
      : begin_(mesh.vertex.size() + 1, 0), corner_(3 * mesh.triangle.size()) {
    for (const Uint3& t : mesh.triangle) {
      for (const std::uint32_t v : t) ++begin_[v + 1];
    }
    for (std::size_t v = 1; v < begin_.size(); ++v) begin_[v] += begin_[v - 1];
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      const auto [a, b, c] = mesh.triangle[t];
      const double area =
          area_of({to_dvec3(position[a]), to_dvec3(position[b]), to_dvec3(position[c])});
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh.triangle[t][k], at = next[v]++;
        corner_[at] = {t, k, area + (at > begin_[v] ? corner_[at - 1].area_end : 0)};
      }
    }
  }

  std::span<const Corner> of(std::uint32_t vertex) const {
    return std::span(corner_).subspan(begin_[vertex], begin_[vertex + 1] - begin_[vertex]);
  }

 private:
  std::vector<std::uint32_t> begin_;
  std::vector<Corner> corner_;
};

// The weights of a uniform point of the third of a triangle that belongs to a corner: a uniform
// point of the whole triangle, rotated so that its largest weight is the corner's.
glm::vec3 near_corner(std::uint32_t corner, const glm::vec2& place) {
  const float root = std::sqrt(place.x);
  const std::array<float, 3> w = {1 - root, root * (1 - place.y), root * place.y};
  const auto largest = static_cast<std::uint32_t>(std::ranges::max_element(w) - w.begin());
  glm::vec3 turned;
  for (std::uint32_t k = 0; k < 3; ++k)
    turned[static_cast<int>((corner + k) % 3)] = w[(largest + k) % 3];
  return turned;
}

// Lights the vertices of a mesh; each stands for the surface around it.
class VertexLighter {
 public:
  VertexLighter(const SurfaceLighter& lighter, const SubdividedMesh& mesh,
                std::span<const Float3> position)
      : lighter_(lighter), mesh_(mesh), around_(mesh, position) {}

  // The colours of vertices [begin, end) with white textures, relative to the screen's white.
  std::vector<glm::vec3> shown(std::uint32_t begin, std::uint32_t end, float exposure_scale) const {
    std::vector<LitPiece> pieces;
    std::vector<CameraSample> samples;
    const auto count = static_cast<std::uint32_t>(lighter_.samples_per_piece());
    for (std::uint32_t v = begin; v < end; ++v) {
      const auto& [triangle, weight] = mesh_.vertex[v];
      pieces.push_back({lighter_.surface().point_on(triangle, weight), size_around(v)});
      for (std::uint32_t k = 0; k < count; ++k) samples.push_back(sample(v, k));
    }
    return lighter_.shown(begin, pieces, samples, exposure_scale, false);
  }

 private:
  // Width of the surface that a vertex stands for, metres.
  float size_around(std::uint32_t v) const {
    return static_cast<float>(std::sqrt(around_.of(v).back().area_end / 3));
  }

  CameraSample sample(std::uint32_t v, std::uint32_t k) const {
    const std::span<const Surroundings::Corner> corners = around_.of(v);
    const float choice =
        (static_cast<float>(k) + 0.5F) / static_cast<float>(lighter_.samples_per_piece());
    const auto chosen = std::min(std::ranges::lower_bound(corners, choice * corners.back().area_end,
                                                          {}, &Surroundings::Corner::area_end),
                                 corners.end() - 1);
    const glm::vec3 inside = near_corner(
        chosen->index, glm::vec2(r2_point(k, {hash_to_unit(v, 0), hash_to_unit(v, 1)})));
    const std::array<glm::vec3, 3>& corner = mesh_.corner[chosen->triangle];
    CameraSample sample{.pixel = v, .index = k};
    sample.point = lighter_.surface().point_on(
        mesh_.display[chosen->triangle],
        inside.x * corner[0] + inside.y * corner[1] + inside.z * corner[2]);
    return sample;
  }

  const SurfaceLighter& lighter_;
  const SubdividedMesh& mesh_;
  Surroundings around_;
};

// The display triangles whose light goes into a texture. Triangles that let light through are lit
// at their vertices, because their texture holds the opacity.
std::vector<std::uint8_t> triangles_with_texels(const TransferData& data) {
  std::vector<std::uint8_t> chosen = data.lightmap.has_texels;
  chosen.resize(data.mesh.triangle.size(), 0);
  for (std::size_t t = 0; t < chosen.size(); ++t) {
    const Material& material = data.materials[data.mesh.triangle_material[t]];
    if (material.alpha_mode != AlphaMode::kOpaque || material.transmitted() > 0) chosen[t] = 0;
  }
  return chosen;
}

int divisions_for(std::size_t triangle_count, std::size_t target) {
  if (triangle_count == 0) return 1;
  const double ratio = static_cast<double>(target) / static_cast<double>(triangle_count);
  return std::clamp(static_cast<int>(std::sqrt(ratio)), 1, kMaxDivisions);
}

// Double precision and whole steps: both sides of an edge compute the same point.
Float3 position_of(const DisplayMesh& mesh, const MeshPlace& place) {
  const Uint3& corner = mesh.triangle[place.triangle];
  glm::dvec3 sum(0);
  for (int k = 0; k < 3; ++k) {
    sum += static_cast<double>(place.weight[k]) *
           to_dvec3(mesh.position[corner[static_cast<std::size_t>(k)]]);
  }
  return to_float3(sum);
}

Float2 texcoord_of(const DisplayMesh& mesh, std::span<const Float2> at, const MeshPlace& place) {
  const Uint3& corner = mesh.triangle[place.triangle];
  const glm::vec2 value = place.weight.x * to_glm(at[corner[0]]) +
                          place.weight.y * to_glm(at[corner[1]]) +
                          place.weight.z * to_glm(at[corner[2]]);
  return {value.x, value.y};
}

LitMesh without_light(const TransferData& data, const SubdividedMesh& mesh) {
  LitMesh lit;
  for (const SubdividedMesh::Part& part : mesh.part) {
    const std::span<const Float2> texcoord =
        part.is_whole ? data.lightmap.texcoord : data.mesh.base_color_texcoord;
    for (std::uint32_t v = part.vertex_begin; v < part.vertex_end; ++v) {
      lit.position.push_back(position_of(data.mesh, mesh.vertex[v]));
      lit.texcoord.push_back(texcoord_of(data.mesh, texcoord, mesh.vertex[v]));
    }
    lit.part.push_back({.material = part.material,
                        .is_in_texture = part.is_whole,
                        .index_begin = 3 * part.triangle_begin,
                        .index_end = 3 * part.triangle_end,
                        .vertex_begin = part.vertex_begin,
                        .vertex_end = part.vertex_end});
    for (std::uint32_t t = part.triangle_begin; t < part.triangle_end; ++t) {
      for (const std::uint32_t v : mesh.triangle[t]) lit.index.push_back(v - part.vertex_begin);
    }
  }
  return lit;
}

// Vertices whose light is in the texture stay white.
void light_vertices(const VertexLighter& lighter, LitMesh& lit) {
  lit.color.assign(lit.position.size(), Float3{1, 1, 1});
  for (const LitMesh::Part& part : lit.part) {
    if (part.is_in_texture) continue;
#pragma omp parallel for schedule(dynamic)
    for (std::uint32_t begin = part.vertex_begin; begin < part.vertex_end; begin += kVertexBlock) {
      const std::vector<glm::vec3> shown = lighter.shown(
          begin, std::min(begin + kVertexBlock, part.vertex_end), std::exp2(lit.exposure));
      for (std::size_t k = 0; k < shown.size(); ++k) {
        // Unbounded light, as close to a lamp, has no defined value on the tone curve.
        const glm::vec3 bounded = glm::min(shown[k], glm::vec3(kBrightestVertex));
        lit.color[begin + k] = to_float3(glm::clamp(tone_curve(bounded), 0.0F, 1.0F));
      }
    }
  }
}

}  // namespace

LitMesh light_mesh(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                   const Camera& camera, const LitMeshSettings& settings) {
  if (settings.samples_per_vertex < 1) throw Error("a lit mesh needs at least one sample a vertex");
  if (data.mesh.triangle.empty()) throw Error("the scene has no triangles to bake");
  if (settings.exposure) check_exposure(*settings.exposure);
  const std::vector<std::uint8_t> in_texture = triangles_with_texels(data);
  const auto count_in_texture =
      static_cast<std::size_t>(std::ranges::count(in_texture, std::uint8_t{1}));
  const std::size_t rest = data.mesh.triangle.size() - count_in_texture;
  const SubdividedMesh mesh =
      subdivide(data.mesh, divisions_for(rest, settings.triangle_target), in_texture);
  LitMesh lit = without_light(data, mesh);
  lit.exposure = settings.exposure ? *settings.exposure
                                   : exposure_for(PictureRenderer(data, tracer), light, camera);
  const SurfaceLighter lighter(data, tracer, light, settings.samples_per_vertex,
                               settings.emitter_samples);
  light_vertices(VertexLighter(lighter, mesh, lit.position), lit);
  if (count_in_texture > 0) {
    lit.texture =
        light_texture(data, lighter, added_at_texels(data, light), in_texture, lit.exposure);
  }
  return lit;
}

}  // namespace rebounce

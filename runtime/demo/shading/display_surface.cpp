#include "runtime/demo/shading/display_surface.h"

#include <algorithm>
#include <cmath>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

// Layers that a camera ray may pass; more than any realistic scene has.
constexpr int kMaxPassedLayers = 256;

glm::vec3 unit_or(const glm::vec3& v, const glm::vec3& otherwise) {
  const float length = glm::length(v);
  return length > 1e-6F ? v / length : otherwise;
}

// The square root of the ratio of texture area to surface area.
float texcoord_per_metre(const DisplayMesh& mesh, std::span<const Float2> texcoord,
                         std::uint32_t triangle) {
  const Uint3& corner = mesh.triangle[triangle];
  const glm::vec2 a = to_glm(texcoord[corner[0]]);
  const glm::vec2 e1 = to_glm(texcoord[corner[1]]) - a, e2 = to_glm(texcoord[corner[2]]) - a;
  const double area = 2 * area_of(corners_of(mesh, triangle));
  return area > 0 ? static_cast<float>(std::sqrt(std::abs(e1.x * e2.y - e1.y * e2.x) / area)) : 0;
}

}  // namespace

DisplaySurface::DisplaySurface(const TransferData& data)
    : data_(&data), textures_(data.textures.size()) {
  const auto decode = [&](std::uint32_t texture) {
    if (texture == kNone || textures_[texture]) return;
    textures_[texture] = std::make_unique<const FilteredTexture>(data.textures[texture]);
  };
  for (const Material& material : data.materials) {
    decode(material.base_color_texture);
    decode(material.emissive_texture);
  }
}

SurfacePoint DisplaySurface::point_on(std::uint32_t triangle, const glm::vec3& weight) const {
  const DisplayMesh& m = mesh();
  // In double precision: the error of the point must not exceed the rounding of its coordinates,
  // otherwise offset_point could leave it on the wrong side.
  const TriangleCorners t = corners_of(m, triangle);
  const double v = weight.y, w = weight.z;
  SurfacePoint point{.triangle = triangle, .weight = weight};
  point.position = glm::vec3((1 - v - w) * t[0] + v * t[1] + w * t[2]);
  point.geometric_normal = unit_or(glm::vec3(front_normal(t)), glm::vec3(0, 1, 0));
  const Uint3& corner = m.triangle[triangle];
  point.shading_normal =
      unit_or(weight.x * to_glm(m.normal[corner[0]]) + weight.y * to_glm(m.normal[corner[1]]) +
                  weight.z * to_glm(m.normal[corner[2]]),
              point.geometric_normal);
  return point;
}

SurfacePoint DisplaySurface::point_at(const Hit& hit) const {
  const glm::vec3 weight(1 - hit.u - hit.v, hit.u, hit.v);
  if (hit.front) return point_on(hit.triangle, weight);
  const auto [a, b, c] = corners_of(mesh(), hit.triangle);
  const glm::dvec3 p =
      (1.0 - hit.u - hit.v) * a + static_cast<double>(hit.u) * b + static_cast<double>(hit.v) * c;
  const std::uint32_t back = mesh().back_triangle[hit.triangle];
  return point_on(back, glm::vec3(weights_at(corners_of(mesh(), back), p)));
}

const Material& DisplaySurface::material_of(const SurfacePoint& point) const {
  return data_->materials[mesh().triangle_material[point.triangle]];
}

glm::vec3 DisplaySurface::texture_color(std::uint32_t texture, std::span<const Float2> texcoord,
                                        const SurfacePoint& point, float width) const {
  if (texture == kNone) return glm::vec3(1);
  return textures_[texture]->sample(texcoord_at(texcoord, point),
                                    width * texcoord_per_metre(mesh(), texcoord, point.triangle));
}

glm::vec2 DisplaySurface::texcoord_at(std::span<const Float2> texcoord,
                                      const SurfacePoint& point) const {
  const Uint3& corner = mesh().triangle[point.triangle];
  return point.weight.x * to_glm(texcoord[corner[0]]) +
         point.weight.y * to_glm(texcoord[corner[1]]) +
         point.weight.z * to_glm(texcoord[corner[2]]);
}

float DisplaySurface::opacity(const Hit& hit) const {
  if (mesh().opacity.of_triangle(hit.triangle).empty()) return 1;
  const SurfacePoint point = point_at(hit);
  const Material& material = material_of(point);
  float alpha = 1;
  if (material.alpha_mode != AlphaMode::kOpaque) {
    alpha = material.base_alpha;
    const std::uint32_t texture = material.base_color_texture;
    if (texture != kNone) {
      alpha *= textures_[texture]->alpha(texcoord_at(mesh().base_color_texcoord, point));
    }
    if (material.alpha_mode == AlphaMode::kMask) alpha = alpha >= material.alpha_cutoff ? 1 : 0;
  }
  return alpha * (1 - material.transmitted());
}

glm::vec3 DisplaySurface::albedo(const SurfacePoint& point, float width) const {
  return untextured_albedo(point) * texture_color(material_of(point).base_color_texture,
                                                  mesh().base_color_texcoord, point, width);
}

glm::vec3 DisplaySurface::untextured_albedo(const SurfacePoint& point) const {
  const Uint3& corner = mesh().triangle[point.triangle];
  const auto& color = mesh().vertex_color;
  const glm::vec3 vertex_color = point.weight.x * to_glm(color[corner[0]]) +
                                 point.weight.y * to_glm(color[corner[1]]) +
                                 point.weight.z * to_glm(color[corner[2]]);
  return to_glm(material_of(point).base_color) * vertex_color;
}

glm::vec3 DisplaySurface::emitted_luminance(const SurfacePoint& point, float width) const {
  const Material& material = material_of(point);
  if (material.emitted_luminance == Float3{0, 0, 0}) return glm::vec3(0);
  return to_glm(material.emitted_luminance) *
         texture_color(material.emissive_texture, mesh().emissive_texcoord, point, width);
}

float beyond(const Hit& hit) {
  return hit.t * (1 + 1e-6F);  // a few rounding errors further
}

bool is_culled(const DisplayMesh& mesh, const Hit& hit) {
  return hit.triangle != kNone && !hit.front && mesh.back_triangle[hit.triangle] == kNone;
}

namespace {

// Finds the first hit of each ray for which `passes`(hit) is false.
template <typename Passes>
void intersect_past(const RayTracer& tracer, Passage passage, const Passes& passes,
                    std::span<Ray> rays, std::span<Hit> hits) {
  tracer.intersect(rays, hits, passage);
  std::vector<std::size_t> passed;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (passes(hits[k])) passed.push_back(k);
  }
  std::vector<Ray> onward;
  std::vector<Hit> next;
  for (int layer = 0; layer < kMaxPassedLayers && !passed.empty(); ++layer) {
    onward.clear();
    for (const std::size_t k : passed) {
      rays[k].t_near = beyond(hits[k]);
      onward.push_back(rays[k]);
    }
    next.resize(onward.size());
    tracer.intersect(onward, next, passage);
    for (std::size_t k = 0; k < passed.size(); ++k) hits[passed[k]] = next[k];
    std::erase_if(passed, [&](std::size_t k) { return !passes(hits[k]); });
  }
  for (const std::size_t k : passed) hits[k] = {};
}

}  // namespace

void intersect_visible(const RayTracer& tracer, const DisplayMesh& mesh, std::span<Ray> rays,
                       std::span<Hit> hits) {
  const auto passes = [&](const Hit& hit) { return is_culled(mesh, hit); };
  intersect_past(tracer, Passage::kHoles, passes, rays, hits);
}

void intersect_visible(const RayTracer& tracer, const DisplaySurface& surface, std::span<Ray> rays,
                       std::span<Hit> hits) {
  const auto passes = [&](const Hit& hit) {
    return is_culled(surface.mesh(), hit) || (hit.triangle != kNone && surface.opacity(hit) == 0);
  };
  intersect_past(tracer, Passage::kSolid, passes, rays, hits);
}

}  // namespace rebounce

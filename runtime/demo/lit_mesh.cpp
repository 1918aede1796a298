#include "rebounce/demo/lit_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "direct_light.h"
#include "display_surface.h"
#include "emitters.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/error.h"
#include "sample_sequence.h"
#include "subdivided_mesh.h"
#include "tone_curve.h"
#include "vertex_light.h"

namespace rebounce {
namespace {

constexpr int kMaxDivisions = 64;
constexpr float kBrightest = 1e6F;     // of the screen's white: white by any curve
constexpr std::uint32_t kBlock = 256;  // vertices that a thread lights at a time

// The triangles around each vertex, and their areas summed up.
class Surroundings {
 public:
  // A corner of a triangle that touches a vertex.
  struct Corner {
    std::uint32_t triangle = 0;
    std::uint32_t index = 0;  // 0 to 2
    double area_end = 0;      // of this triangle and those before it
  };

  Surroundings(const SubdividedMesh& mesh, std::span<const Float3> position)
      : begin_(mesh.vertex.size() + 1, 0), corner_(3 * mesh.triangle.size()) {
    for (const Uint3& t : mesh.triangle) {
      for (const std::uint32_t v : t) ++begin_[v + 1];
    }
    for (std::size_t v = 1; v < begin_.size(); ++v) begin_[v] += begin_[v - 1];
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
      const double area = area_of(mesh.triangle[t], position);
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
  static double area_of(const Uint3& t, std::span<const Float3> position) {
    const glm::dvec3 a = to_dvec3(position[t[0]]);
    return 0.5 *
           glm::length(glm::cross(to_dvec3(position[t[1]]) - a, to_dvec3(position[t[2]]) - a));
  }

  std::vector<std::uint32_t> begin_;
  std::vector<Corner> corner_;
};

// The weights of a point that is uniform over the third of a triangle that belongs to a corner: a
// uniform point of the whole, turned so that its largest weight is the corner's.
glm::vec3 near_corner(std::uint32_t corner, const glm::vec2& place) {
  const float root = std::sqrt(place.x);
  const std::array<float, 3> w = {1 - root, root * (1 - place.y), root * place.y};
  const auto largest = static_cast<std::uint32_t>(std::ranges::max_element(w) - w.begin());
  glm::vec3 turned;
  for (std::uint32_t k = 0; k < 3; ++k)
    turned[static_cast<int>((corner + k) % 3)] = w[(largest + k) % 3];
  return turned;
}

class VertexLighter {
 public:
  VertexLighter(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                const LitMeshSettings& settings, const SubdividedMesh& mesh,
                std::span<const Float3> position)
      : data_(data),
        tracer_(tracer),
        light_(light),
        settings_(settings),
        mesh_(mesh),
        surface_(data),
        emitters_(data, surface_, settings.emitter_samples),
        vertex_light_(light_at_vertices(data, light)),
        around_(mesh, position) {}

  // What vertices [begin, end) show if their textures are white, in parts of the screen's white.
  void light(std::uint32_t begin, std::uint32_t end, float exposure_scale,
             std::span<glm::vec3> shown) const {
    const std::vector<glm::vec3> direct = direct_irradiance(begin, end);
    for (std::uint32_t v = begin; v < end; ++v) {
      const SurfacePoint point =
          surface_.point_on(mesh_.vertex[v].triangle, mesh_.vertex[v].weight);
      const glm::vec3 irradiance = direct[v - begin] +
                                   interpolate(data_.mesh, vertex_light_.sky, point) +
                                   interpolate(data_.mesh, vertex_light_.bounced, point);
      const glm::vec3 reflected =
          surface_.untextured_albedo(point) * irradiance * std::numbers::inv_pi_v<float>;
      const glm::vec3 emitted = surface_.emitted_luminance(point, size_around(v));
      shown[v] = exposure_scale * reflected + dimmed(exposure_scale * emitted, kBrightestEmitter);
    }
  }

 private:
  // Width of the surface that a vertex stands for, metres.
  float size_around(std::uint32_t v) const {
    return static_cast<float>(std::sqrt(around_.of(v).back().area_end / 3));
  }

  CameraSample sample(std::uint32_t v, std::uint32_t k) const {
    const std::span<const Surroundings::Corner> corners = around_.of(v);
    const float choice =
        (static_cast<float>(k) + 0.5F) / static_cast<float>(settings_.samples_per_vertex);
    const auto chosen = std::min(std::ranges::lower_bound(corners, choice * corners.back().area_end,
                                                          {}, &Surroundings::Corner::area_end),
                                 corners.end() - 1);
    const glm::vec3 inside =
        near_corner(chosen->index, r2_point(k, {hash_to_unit(v, 0), hash_to_unit(v, 1)}));
    const std::array<glm::vec3, 3>& corner = mesh_.corner[chosen->triangle];
    CameraSample sample{.pixel = v, .index = k};
    sample.point =
        surface_.point_on(mesh_.display[chosen->triangle],
                          inside.x * corner[0] + inside.y * corner[1] + inside.z * corner[2]);
    return sample;
  }

  // Those samples that do not lie inside a solid body, where the first thing above is a back.
  std::vector<CameraSample> uncovered(std::span<const CameraSample> samples) const {
    std::vector<Ray> rays;
    for (const CameraSample& s : samples) {
      const Float3 normal = to_float3(s.point.geometric_normal);
      rays.push_back({.origin = tracer_.offset_point(to_float3(s.point.position), normal),
                      .t_near = 0,
                      .direction = normal,
                      .t_far = std::numeric_limits<float>::infinity()});
    }
    std::vector<Hit> hits(rays.size());
    tracer_.intersect(rays, hits);
    std::vector<CameraSample> kept;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      if (!is_culled(data_.mesh, hits[k])) kept.push_back(samples[k]);
    }
    return kept;
  }

  std::vector<glm::vec3> direct_irradiance(std::uint32_t begin, std::uint32_t end) const {
    std::vector<CameraSample> samples;
    const auto count = static_cast<std::uint32_t>(settings_.samples_per_vertex);
    for (std::uint32_t v = begin; v < end; ++v) {
      for (std::uint32_t k = 0; k < count; ++k) samples.push_back(sample(v, k));
    }
    samples = uncovered(samples);
    add_punctual_light(samples, light_.lights, tracer_);
    add_emitter_light(samples, emitters_, tracer_, settings_.samples_per_vertex);
    std::vector<glm::vec3> mean(end - begin, glm::vec3(0));
    std::vector<int> open(end - begin, 0);
    for (const CameraSample& s : samples) {
      mean[s.pixel - begin] += s.irradiance;
      ++open[s.pixel - begin];
    }
    for (std::size_t k = 0; k < mean.size(); ++k) {
      mean[k] /= static_cast<float>(std::max(1, open[k]));
    }
    return mean;
  }

  const TransferData& data_;
  const RayTracer& tracer_;
  const PictureLight& light_;
  const LitMeshSettings& settings_;
  const SubdividedMesh& mesh_;
  DisplaySurface surface_;
  Emitters emitters_;
  VertexLight vertex_light_;
  Surroundings around_;
};

int divisions_for(std::size_t triangle_count, std::size_t target) {
  const double ratio = static_cast<double>(target) / static_cast<double>(triangle_count);
  return std::clamp(static_cast<int>(std::sqrt(ratio)), 1, kMaxDivisions);
}

// Double precision and whole steps: both sides of an edge find the same point.
Float3 position_of(const DisplayMesh& mesh, const MeshPlace& place) {
  const Uint3& corner = mesh.triangle[place.triangle];
  glm::dvec3 sum(0);
  for (int k = 0; k < 3; ++k) {
    sum += static_cast<double>(place.weight[k]) *
           to_dvec3(mesh.position[corner[static_cast<std::size_t>(k)]]);
  }
  return to_float3(sum);
}

Float2 texcoord_of(const DisplayMesh& mesh, const MeshPlace& place) {
  const Uint3& corner = mesh.triangle[place.triangle];
  const auto& at = mesh.base_color_texcoord;
  const glm::vec2 value = place.weight.x * to_glm(at[corner[0]]) +
                          place.weight.y * to_glm(at[corner[1]]) +
                          place.weight.z * to_glm(at[corner[2]]);
  return {value.x, value.y};
}

LitMesh without_light(const DisplayMesh& display, const SubdividedMesh& mesh) {
  LitMesh lit;
  for (const MeshPlace& place : mesh.vertex) {
    lit.position.push_back(position_of(display, place));
    lit.texcoord.push_back(texcoord_of(display, place));
  }
  for (const SubdividedMesh::Part& part : mesh.part) {
    lit.part.push_back({.material = part.material,
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

}  // namespace

LitMesh light_mesh(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                   const Camera& camera, const LitMeshSettings& settings) {
  if (settings.samples_per_vertex < 1) throw Error("a lit mesh needs at least one sample a vertex");
  const SubdividedMesh mesh =
      subdivide(data.mesh, divisions_for(data.mesh.triangle.size(), settings.triangle_target));
  LitMesh lit = without_light(data.mesh, mesh);
  lit.exposure = settings.exposure ? *settings.exposure
                                   : exposure_for(PictureRenderer(data, tracer), light, camera);

  const VertexLighter lighter(data, tracer, light, settings, mesh, lit.position);
  const auto vertex_count = static_cast<std::uint32_t>(mesh.vertex.size());
  std::vector<glm::vec3> shown(vertex_count);
#pragma omp parallel for schedule(dynamic)
  for (std::uint32_t begin = 0; begin < vertex_count; begin += kBlock) {
    lighter.light(begin, std::min(begin + kBlock, vertex_count), std::exp2(lit.exposure), shown);
  }
  for (const glm::vec3& value : shown) {
    // Light without bound, as right beside a lamp, has no place on the curve.
    const glm::vec3 bounded = glm::min(value, glm::vec3(kBrightest));
    lit.color.push_back(to_float3(glm::clamp(tone_curve(bounded), 0.0F, 1.0F)));
  }
  return lit;
}

}  // namespace rebounce

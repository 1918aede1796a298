#include "runtime/demo/picture/camera.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <vector>

#include "rebounce/error.h"
#include "runtime/demo/shading/display_surface.h"
#include "runtime/rays/box.h"

namespace rebounce {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kRoomFov = 65 * kPi / 180;     // vertical: a wide angle, for the inside of a room
constexpr float kOutsideFov = 40 * kPi / 180;  // vertical: for a box seen through its open side
constexpr int kProbeColumns = 16, kProbeRows = 12;

float diagonal(const Box& box) {
  return glm::length(box.extent());
}

std::vector<Ray> probe_rays(const Camera& camera) {
  std::vector<Ray> rays;
  const float extent = std::tan(0.5F * camera.vertical_fov);
  for (int row = 0; row < kProbeRows; ++row) {
    for (int column = 0; column < kProbeColumns; ++column) {
      const float x =
          ((column + 0.5F) / kProbeColumns * 2 - 1) * extent * kProbeColumns / kProbeRows;
      const float y = ((row + 0.5F) / kProbeRows * 2 - 1) * extent;
      rays.push_back({.origin = camera.position,
                      .t_near = 0,
                      .direction = to_float3(x * to_glm(camera.right) + y * to_glm(camera.up) -
                                             to_glm(camera.backward)),
                      .t_far = std::numeric_limits<float>::infinity()});
    }
  }
  return rays;
}

// One minus the probability that two rays of the view hit the same kind of surface.
float variety(const std::map<std::uint32_t, int>& count, int total) {
  float same = 0;
  for (const auto& [kind, c] : count) {
    const float share = static_cast<float>(c) / static_cast<float>(total);
    same += share * share;
  }
  return 1 - same;
}

std::uint32_t orientation(const glm::vec3& normal) {
  const glm::vec3 size = glm::abs(normal);
  const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  return static_cast<std::uint32_t>(2 * axis + (normal[axis] > 0 ? 1 : 0));
}

// Marks lit patches: those with at least a twentieth of the mean radiosity; all patches if there is
// no light.
std::vector<bool> lit_patches(const TransferData& data, std::span<const Float3> radiosity) {
  double power = 0, area = 0;
  for (std::size_t i = 0; i < radiosity.size(); ++i) {
    power += data.patches.area[i] * (radiosity[i][0] + radiosity[i][1] + radiosity[i][2]);
    area += data.patches.area[i];
  }
  std::vector<bool> lit(data.patches.size(), true);
  for (std::size_t i = 0; i < radiosity.size(); ++i) {
    lit[i] = (radiosity[i][0] + radiosity[i][1] + radiosity[i][2]) * area >= 0.05 * power;
  }
  return lit;
}

// The quality of a view: much lit surface, nothing too near, many orientations and materials, no
// culled faces.
float score(const Camera& camera, const TransferData& data, const RayTracer& tracer,
            const std::vector<bool>& lit, float diagonal) {
  std::vector<Ray> rays = probe_rays(camera);
  std::vector<Hit> hits(rays.size());
  intersect_visible(tracer, data.mesh, rays, hits);
  std::map<std::uint32_t, int> kinds;
  int seen = 0, seen_lit = 0, through_culled = 0, too_near = 0;
  float depth = 0;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    through_culled += rays[k].t_near > 0;
    if (hits[k].triangle == kNone) continue;
    ++seen;
    const std::uint32_t side =
        hits[k].front ? hits[k].triangle : data.mesh.back_triangle[hits[k].triangle];
    const std::uint32_t patch = side == kNone ? kNone : data.mesh.triangle_patch[side];
    seen_lit += patch == kNone || lit[patch];
    too_near += hits[k].t < 0.04F * diagonal;
    depth += std::log1p(20 * hits[k].t / diagonal);
    const Uint3& corner = data.mesh.triangle[hits[k].triangle];
    const glm::vec3 a = to_glm(data.mesh.position[corner[0]]);
    const glm::vec3 normal = glm::cross(to_glm(data.mesh.position[corner[1]]) - a,
                                        to_glm(data.mesh.position[corner[2]]) - a);
    ++kinds[6 * data.mesh.triangle_material[hits[k].triangle] +
            orientation(hits[k].front ? normal : -normal)];
  }
  if (seen == 0) return 0;
  const auto share = [&](int count) {
    return static_cast<float>(count) / static_cast<float>(hits.size());
  };
  const float clear = (1 - share(through_culled)) * (1 - share(too_near));
  const float lit_share = static_cast<float>(seen_lit) / static_cast<float>(seen);
  return share(seen) * lit_share * lit_share * clear * clear * (depth / static_cast<float>(seen)) *
         (0.2F + variety(kinds, seen));
}

std::vector<Camera> views_from_inside(const Box& box) {
  constexpr int kPlaces = 5, kHeadings = 8;
  std::vector<Camera> views;
  for (const float height : {0.35F, 0.5F}) {
    for (int i = 0; i < kPlaces; ++i) {
      for (int j = 0; j < kPlaces; ++j) {
        const glm::vec3 fraction((i + 0.5F) / kPlaces, height, (j + 0.5F) / kPlaces);
        const glm::vec3 eye = glm::mix(box.low, box.high, fraction);
        for (int k = 0; k < kHeadings; ++k) {
          const float angle = 2 * kPi * static_cast<float>(k) / kHeadings;
          const glm::vec3 ahead(std::sin(angle), 0, -std::cos(angle));
          views.push_back(
              look_at(to_float3(eye), to_float3(eye + diagonal(box) * ahead), kRoomFov));
        }
      }
    }
  }
  return views;
}

// One view of each of the four upright sides of the box, towards its centre; the side fills the
// picture.
std::vector<Camera> views_from_outside(const Box& box) {
  std::vector<Camera> views;
  const glm::vec3 center = 0.5F * (box.low + box.high), size = box.high - box.low;
  for (const int axis : {0, 2}) {
    const float half_extent = 0.5F * std::max(size.y, size[2 - axis] * kProbeRows / kProbeColumns);
    const float distance = half_extent / std::tan(0.5F * kOutsideFov) + 0.5F * size[axis];
    for (const float side : {1.0F, -1.0F}) {
      glm::vec3 eye = center;
      eye[axis] += side * (distance + 0.01F * diagonal(box));
      views.push_back(look_at(to_float3(eye), to_float3(center), kOutsideFov));
    }
  }
  return views;
}

}  // namespace

Camera look_at(const Float3& position, const Float3& target, float vertical_fov) {
  if (!(vertical_fov > 0 && vertical_fov < kPi)) {
    throw Error("camera: the field of view must be between 0 and 180 degrees");
  }
  const glm::vec3 away = to_glm(position) - to_glm(target);
  const float distance = glm::length(away);
  if (!(distance > 0) || std::isinf(distance)) {
    throw Error("camera: position and target must be two different points");
  }
  const glm::vec3 backward = away / distance;
  const bool upright = std::abs(backward.y) < 0.9999F;
  const glm::vec3 right =
      glm::normalize(glm::cross(upright ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1), backward));
  Camera camera;
  camera.position = position;
  camera.right = to_float3(right);
  camera.up = to_float3(glm::cross(backward, right));
  camera.backward = to_float3(backward);
  camera.vertical_fov = vertical_fov;
  return camera;
}

Camera fit_camera(const TransferData& data, const RayTracer& tracer,
                  std::span<const Float3> radiosity) {
  if (data.mesh.position.empty()) return look_at({0, 0, 1}, {0, 0, 0}, kRoomFov);
  const Box box = box_around(data.mesh.position);
  std::vector<Camera> views = views_from_outside(box);
  for (const Camera& view : views_from_inside(box)) views.push_back(view);
  const std::vector<bool> lit = lit_patches(data, radiosity);
  const Camera* best = &views.front();
  float best_score = -1;
  for (const Camera& view : views) {
    const float value = score(view, data, tracer, lit, diagonal(box));
    if (value > best_score) {
      best_score = value;
      best = &view;
    }
  }
  return *best;
}

}  // namespace rebounce

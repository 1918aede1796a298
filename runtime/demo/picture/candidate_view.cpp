#include "runtime/demo/picture/candidate_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "runtime/demo/picture/camera.h"
#include "runtime/demo/picture/view_score.h"
#include "runtime/demo/shading/display_surface.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;
constexpr float kInsideFov = 55 * kDegree;   // vertical: a wide angle, for the inside of a room
constexpr float kOutsideFov = 40 * kDegree;  // vertical: for what is seen whole
constexpr float kHighestScene = 50;          // metres: what is higher has another unit
constexpr int kColumns = 12;
constexpr int kHeadings = 16;
constexpr int kRaysAround = 64;
constexpr float kOutsideWeight = 0.85F;

// The middle of a column, as a part of the side.
float middle_of(int column) {
  return (static_cast<float>(column) + 0.5F) / kColumns;
}

// A surface to stand on, by its height, and the free height above it.
struct Floor {
  float height = 0, headroom = 0;
};

// The floors along an upright line.
std::vector<Floor> floors_at(const DisplayMesh& mesh, const RayTracer& tracer, const Box& box,
                             float x, float z) {
  const float above = box.high.y + 0.01F * static_cast<float>(box.diagonal());
  std::vector<Hit> hits;
  tracer.intersect_all({.origin = {x, above, z},
                        .t_near = 0,
                        .direction = {0, -1, 0},
                        .t_far = std::numeric_limits<float>::infinity()},
                       hits);
  std::ranges::sort(hits, {}, &Hit::t);
  std::vector<Floor> floors;
  float ceiling = 0;
  for (const Hit& hit : hits) {
    const float slope = static_cast<float>(front_normal(corners_of(mesh, hit.triangle)).y);
    if (std::abs(slope) > 0.9F && !is_culled(mesh, hit)) {
      floors.push_back({.height = above - hit.t, .headroom = hit.t - ceiling});
    }
    ceiling = hit.t;
  }
  return floors;
}

// The part of all directions in which surface surrounds the eye; 0 where nobody can be.
float enclosure_of(const DisplayMesh& mesh, const RayTracer& tracer, const glm::vec3& eye,
                   float reach) {
  constexpr float kGoldenAngle = 2.3999632F;
  std::vector<Ray> rays;
  for (int k = 0; k < kRaysAround; ++k) {
    const float y = 1 - (2 * static_cast<float>(k) + 1) / kRaysAround;
    const float angle = kGoldenAngle * static_cast<float>(k), r = std::sqrt(1 - y * y);
    rays.push_back({.origin = to_float3(eye),
                    .t_near = 0,
                    .direction = {r * std::cos(angle), y, r * std::sin(angle)},
                    .t_far = std::numeric_limits<float>::infinity()});
  }
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  int met = 0, behind = 0;
  for (const Hit& hit : hits) {
    if (hit.triangle == kNone) continue;
    if (hit.t < reach) return 0;
    ++met;
    behind += is_culled(mesh, hit) ? 1 : 0;
  }
  return behind > kRaysAround / 16 ? 0 : static_cast<float>(met) / kRaysAround;
}

glm::vec3 heading(int k, float elevation) {
  const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kHeadings;
  return {std::cos(elevation) * std::sin(angle), std::sin(elevation),
          std::cos(elevation) * std::cos(angle)};
}

// True if the side of the box that faces `outwards`, along an axis, lets one look in: behind most
// of it is surface, but not in the first quarter of the depth.
bool is_open(const RayTracer& tracer, const Box& box, const glm::vec3& outwards) {
  const int axis = outwards.x != 0 ? 0 : 2;
  const float margin = 0.01F * box.extent()[axis];
  std::vector<Ray> rays;
  for (int cell = 0; cell < kColumns * kColumns; ++cell) {
    glm::vec3 part(middle_of(cell / kColumns));
    part.y = middle_of(cell % kColumns);
    glm::vec3 origin = glm::mix(box.low, box.high, part);
    origin[axis] = outwards[axis] > 0 ? box.high[axis] + margin : box.low[axis] - margin;
    rays.push_back({.origin = to_float3(origin),
                    .t_near = 0,
                    .direction = to_float3(-outwards),
                    .t_far = std::numeric_limits<float>::infinity()});
  }
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  const auto deep = std::ranges::count_if(hits, [&](const Hit& hit) {
    return hit.triangle != kNone && hit.t > margin + 0.25F * box.extent()[axis];
  });
  return 2 * static_cast<std::size_t>(deep) > hits.size();
}

// As near as shows the whole box.
Camera view_of(const Box& box, const glm::vec3& direction) {
  constexpr float kMargin = 1.02F;
  const glm::vec3 center = 0.5F * (box.low + box.high);
  Camera camera = look_at(to_float3(direction), {0, 0, 0}, kOutsideFov);
  float distance = 0;
  for (int k = 0; k < 8; ++k) {
    const glm::vec3 corner((k & 1) != 0 ? box.high.x : box.low.x,
                           (k & 2) != 0 ? box.high.y : box.low.y,
                           (k & 4) != 0 ? box.high.z : box.low.z);
    const glm::vec3 way = corner - center;
    const float half_height = std::max(std::abs(glm::dot(way, to_glm(camera.right))) / kViewAspect,
                                       std::abs(glm::dot(way, to_glm(camera.up))));
    distance = std::max(distance, glm::dot(way, to_glm(camera.backward)) +
                                      half_height / std::tan(0.5F * kOutsideFov));
  }
  camera.position = to_float3(center + kMargin * distance * direction);
  return camera;
}

}  // namespace

Viewer viewer_for(const Box& scene) {
  const Viewer person;
  const float height = scene.extent().y;
  if (height >= person.headroom && height <= kHighestScene) return person;
  const float size = std::max(height, 0.1F * static_cast<float>(scene.diagonal()));
  return {.eye_height = 0.5F * size, .headroom = 0.6F * size};
}

std::vector<CandidateView> views_from_floors(const DisplayMesh& mesh, const RayTracer& tracer,
                                             const Box& box, const Viewer& viewer) {
  std::vector<CandidateView> views;
  for (int cell = 0; cell < kColumns * kColumns; ++cell) {
    const float x = glm::mix(box.low.x, box.high.x, middle_of(cell / kColumns));
    const float z = glm::mix(box.low.z, box.high.z, middle_of(cell % kColumns));
    for (const Floor& floor : floors_at(mesh, tracer, box, x, z)) {
      if (floor.headroom < viewer.headroom) continue;
      const glm::vec3 eye(x, floor.height + viewer.eye_height, z);
      const float enclosure = enclosure_of(mesh, tracer, eye, 0.2F * viewer.eye_height);
      const float weight = std::min(1.0F, (enclosure - 0.5F) / 0.4F);
      if (weight <= 0) continue;
      for (int k = 0; k < kHeadings; ++k) {
        Camera camera = look_at({0, 0, 0}, to_float3(heading(k, 0)), kInsideFov);
        camera.position = to_float3(eye);
        views.push_back({.camera = camera, .weight = weight});
      }
    }
  }
  return views;
}

std::vector<CandidateView> views_from_outside(const RayTracer& tracer, const Box& box) {
  std::vector<CandidateView> views;
  const auto add = [&](const glm::vec3& direction) {
    views.push_back({.camera = view_of(box, direction), .weight = kOutsideWeight});
  };
  for (int k = 0; k < kHeadings; k += kHeadings / 4) {
    if (is_open(tracer, box, glm::round(heading(k, 0)))) add(glm::round(heading(k, 0)));
  }
  for (const float elevation : {20 * kDegree, 35 * kDegree, 55 * kDegree}) {
    for (int k = 0; k < kHeadings; ++k) {
      if (k % (kHeadings / 4) != 0) add(heading(k, elevation));  // more than one side is seen
    }
  }
  return views;
}

}  // namespace rebounce

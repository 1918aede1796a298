#include "runtime/lights/shadow_volumes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace rebounce {
namespace {

constexpr std::size_t kLanes = OccluderGroup::kLanes, kCorners = OccluderGroup::kCorners;
constexpr float kNever = std::numeric_limits<float>::max();  // distance of a plane without
                                                             // an inner side

// The cosine to a plane's normal up to which a lamp without a place lies in the plane: more than
// rounding of unit vectors makes.
constexpr float kLeastCosine = 1e-6F;
using Vectors = OccluderGroup::Vectors;

void put(Vectors& vectors, std::size_t lane, const glm::vec3& v) {
  for (int axis = 0; axis < 3; ++axis) vectors[axis][lane] = v[axis];
}

void put(PlaneLanes& planes, std::size_t lane, const glm::vec3& normal, float distance) {
  planes.x[lane] = normal.x;
  planes.y[lane] = normal.y;
  planes.z[lane] = normal.z;
  planes.distance[lane] = distance;
}

VolumePlanes::Plane plane_through(const glm::vec3& at, const glm::vec3& normal) {
  return {normal.x, normal.y, normal.z, glm::dot(at, normal)};
}

}  // namespace

OccluderGroups::OccluderGroups(const Occluders& occluders)
    : group((occluders.piece.size() + kLanes - 1) / kLanes),
      piece(occluders.piece.size()),
      is_whole(occluders.is_whole) {
  for (std::size_t k = 0; k < occluders.piece.size(); ++k) {
    OccluderGroup& here = group[k / kLanes];
    const std::size_t lane = k % kLanes;
    const Occluder& occluder = occluders.piece[k];
    put(here.normal, lane, occluder.normal);
    here.solid[lane] = occluder.solid;
    for (std::size_t c = 0; c < kCorners; ++c) {
      const glm::vec3 from = occluder.corner[c];
      const glm::vec3 along = occluder.corner[(c + 1) % kCorners] - from;
      const float length = glm::length(along);
      const glm::vec3 inward =
          length > 0 ? glm::cross(occluder.normal, along / length) : glm::vec3(0);
      put(here.corner[c], lane, from);
      put(here.inward[c], lane, inward);
      piece[k].plane[c] = plane_through(from, inward);
    }
    piece[k].plane[kCorners] = plane_through(occluder.corner[0], occluder.normal);
  }
}

/// What a lamp's surface lies in: a ball around its position, or the parallelogram that its sides
/// span there. A lamp without a place is infinitely far.
struct ShadowVolumes::Lamp {
  Lamp(const PreparedLight& lamp, float of_planes)
      : at(lamp.kind->has_place() ? lamp.position : -lamp.direction),
        has_place(lamp.kind->has_place() ? 1.0F : 0.0F),
        tolerance(lamp.kind->has_place() ? of_planes : kLeastCosine) {
    if (!lamp.has_area()) return;
    side = lamp.side;
    other_side = lamp.other_side;
    is_flat = side != glm::vec3(0);
    if (!is_flat) radius = lamp.radius;
  }

  glm::vec3 at, side{0}, other_side{0};
  float has_place, radius = 0, tolerance;
  bool is_flat = false;

  /// How far it reaches along `direction` to either side of its middle.
  float reach(float x, float y, float z) const {
    return radius + std::abs(x * side.x + y * side.y + z * side.z) +
           std::abs(x * other_side.x + y * other_side.y + z * other_side.z);
  }
};

void ShadowVolumes::set(const PreparedLight& lamp, std::span<const OccluderGroup> groups,
                        float tolerance) {
  const Lamp of_lamp(lamp, tolerance);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (std::size_t side = 0; side < kCorners; ++side) {
      set_side(of_lamp, groups[g], side, outer_[g].plane[side], inner_[g].plane[side]);
    }
    set_plane(of_lamp, groups[g], g);
    spread(outer_[g], &outer_planes_[g * kLanes]);
    spread(inner_[g], &inner_planes_[g * kLanes]);
  }
}

/// The plane of an occluder, turned away from the lamp. What is behind it may be in the shadow.
void ShadowVolumes::set_plane(const Lamp& lamp, const OccluderGroup& group, std::size_t g) {
  const auto& [corner_x, corner_y, corner_z] = group.corner[0];
  const auto& [normal_x, normal_y, normal_z] = group.normal;
  PlaneLanes &outer = outer_[g].plane[kCorners], &inner = inner_[g].plane[kCorners];
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float x = normal_x[k], y = normal_y[k], z = normal_z[k];
    const float height = (lamp.at.x - lamp.has_place * corner_x[k]) * x +
                         (lamp.at.y - lamp.has_place * corner_y[k]) * y +
                         (lamp.at.z - lamp.has_place * corner_z[k]) * z;
    const float reach = lamp.reach(x, y, z);
    const bool in_front = height - reach >= -lamp.tolerance;
    const bool behind = height + reach <= lamp.tolerance;
    const float sign = in_front ? -1.0F : behind ? 1.0F : 0.0F;
    const bool is_there = x * x + y * y + z * z > 0;
    outer.x[k] = inner.x[k] = sign * x;
    outer.y[k] = inner.y[k] = sign * y;
    outer.z[k] = inner.z[k] = sign * z;
    const float distance = sign * (corner_x[k] * x + corner_y[k] * y + corner_z[k] * z);
    // A lamp in the plane meets only its edge.
    outer.distance[k] = is_there && !(in_front && behind) ? distance : kNever;
    inner.distance[k] = in_front != behind && group.solid[k] ? distance : kNever;
  }
}

/// The planes through a side of an occluder that touch the lamp: on the far side of it for all that
/// is in part in the shadow, on the near side for what is wholly in the shadow. In coordinates
/// across the side: y inwards in the plane of the occluder, z from it to the lamp's side.
void ShadowVolumes::set_side(const Lamp& lamp, const OccluderGroup& group, std::size_t side,
                             PlaneLanes& outer, PlaneLanes& inner) {
  constexpr float kLeast = 1e-12F;  // instead of division by zero
  const auto& [corner_x, corner_y, corner_z] = group.corner[side];
  const auto& [inward_x, inward_y, inward_z] = group.inward[side];
  const auto& [normal_x, normal_y, normal_z] = group.normal;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const glm::vec3 inward(inward_x[k], inward_y[k], inward_z[k]);
    const glm::vec3 normal(normal_x[k], normal_y[k], normal_z[k]);
    const glm::vec3 corner(corner_x[k], corner_y[k], corner_z[k]);
    const glm::vec3 path = lamp.at - lamp.has_place * corner;
    const float y = glm::dot(path, inward), height = glm::dot(path, normal);
    const float reach = lamp.reach(normal.x, normal.y, normal.z);
    const float side_sign = height < 0 ? -1.0F : 1.0F;
    const float z = std::max(std::abs(height), kLeast);
    const bool straddles = height - reach < -lamp.tolerance && height + reach > lamp.tolerance;
    // Normals of the planes, along `inward` and along the occluder's normal on the lamp's side.
    float outer_y = 1, outer_z = 0, inner_y = 1, inner_z = 0;
    if (lamp.is_flat) {
      const float y_1 = glm::dot(lamp.side, inward), z_1 = side_sign * glm::dot(lamp.side, normal);
      const float y_2 = glm::dot(lamp.other_side, inward);
      const float z_2 = side_sign * glm::dot(lamp.other_side, normal);
      float most = -std::numeric_limits<float>::infinity(), least = -most;
      for (const float a : {-1.0F, 1.0F}) {
        for (const float b : {-1.0F, 1.0F}) {
          const float slope = (y + a * y_1 + b * y_2) / std::max(z + a * z_1 + b * z_2, kLeast);
          most = std::max(most, slope);
          least = std::min(least, slope);
        }
      }
      outer_y = 1 / std::sqrt(1 + most * most);
      outer_z = -most * outer_y;
      inner_y = 1 / std::sqrt(1 + least * least);
      inner_z = -least * inner_y;
    } else {
      const float distance_squared = y * y + z * z;
      const float tilt = lamp.radius / distance_squared;  // sine / distance
      const float straight =
          std::sqrt(std::max(0.0F, distance_squared - lamp.radius * lamp.radius)) /
          distance_squared;  // cosine / distance
      outer_y = straight * z - tilt * y;
      outer_z = -straight * y - tilt * z;
      inner_y = straight * z + tilt * y;
      inner_z = -straight * y + tilt * z;
    }
    // Where the lamp is on both sides of the occluder's plane, that across it parts them if the
    // whole lamp is beyond the side.
    const float reach_inward = lamp.reach(inward.x, inward.y, inward.z);
    const float beyond = y + reach_inward <= 0 ? 1.0F : 0.0F;
    outer_y = straddles ? beyond : outer_y;
    outer_z = straddles ? 0 : side_sign * outer_z;
    inner_z = side_sign * inner_z;
    const float is_side = glm::dot(inward, inward) > 0 ? 1.0F : 0.0F;
    const glm::vec3 to_outer = is_side * (outer_y * inward + outer_z * normal);
    const glm::vec3 to_inner = is_side * (inner_y * inward + inner_z * normal);
    put(outer, k, to_outer, glm::dot(to_outer, corner));
    put(inner, k, to_inner, glm::dot(to_inner, corner));
  }
}

template <typename Visit>
ShadowVolumes::Between ShadowVolumes::visit_between(const Box& box, Number group,
                                                    const Visit& visit) const {
  const ShadowKernels& kernels = shadow_kernels();
  const glm::vec3 middle = 0.5F * (box.low + box.high), half = 0.5F * (box.high - box.low);
  const unsigned meets = kernels.box_in_volumes(outer_[group].plane, &middle.x, &half.x, 1);
  if (meets == 0) return Between::kSome;
  if (kernels.box_in_volumes(inner_[group].plane, &middle.x, &half.x, -1) != 0) {
    return Between::kHidden;
  }
  for (unsigned left = meets; left != 0; left &= left - 1) {
    const auto lane = static_cast<Number>(std::countr_zero(left));
    if (!visit(group * static_cast<Number>(kLanes) + lane)) return Between::kMany;
  }
  return Between::kSome;
}

ShadowVolumes::Between ShadowVolumes::groups_between(const Box& box, std::span<Number> room,
                                                     std::size_t& count) const {
  count = 0;
  for (Number group = 0; group < outer_.size(); ++group) {
    bool any = false;
    const Between here = visit_between(box, group, [&](Number) { return any = true; });
    if (here != Between::kSome) return here;
    if (!any) continue;
    if (count == room.size()) return Between::kMany;
    room[count++] = group;
  }
  return Between::kSome;
}

ShadowVolumes::Between ShadowVolumes::between(const Box& box, std::span<const Number> groups,
                                              std::span<Number> room, std::size_t& count) const {
  count = 0;
  for (const Number group : groups) {
    const Between here = visit_between(box, group, [&](Number number) {
      if (count == room.size()) return false;
      room[count++] = number;
      return true;
    });
    if (here != Between::kSome) return here;
  }
  return Between::kSome;
}

bool ShadowVolumes::is_certain(Number number) const {
  return inner_[number / kLanes].plane[kCorners].distance[number % kLanes] != kNever;
}

/// Writes down each volume of a group.
void ShadowVolumes::spread(const Group& group, VolumePlanes* volume) {
  for (std::size_t p = 0; p < VolumePlanes::kPlanes; ++p) {
    const PlaneLanes& lanes = group.plane[p];
    for (std::size_t k = 0; k < kLanes; ++k) {
      volume[k].plane[p] = {lanes.x[k], lanes.y[k], lanes.z[k], lanes.distance[k]};
    }
  }
}

}  // namespace rebounce

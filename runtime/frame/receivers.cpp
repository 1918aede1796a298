#include "runtime/frame/receivers.h"

#include <algorithm>
#include <string>

#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

void check_settings(const DirectLightingSettings& settings) {
  if (settings.area_light_samples < 1 || settings.area_light_samples > kMaxAreaLightSamples) {
    throw Error("direct light needs from 1 to " + std::to_string(kMaxAreaLightSamples) +
                " samples of lamps with a surface");
  }
}

/// [patches][points_per_patch]
std::vector<LitPoint> lit_points(const TransferData& data, const DirectLightingSettings& settings) {
  std::vector<LitPoint> points;
  for (const auto& [position, normal] : receiver_points(data, settings)) {
    points.push_back({to_glm(position), to_glm(normal)});
  }
  return points;
}

struct OrientedBox {
  glm::vec3 middle;
  std::array<glm::vec3, 3> half_side;
};

/// A box around points of one patch: flat if the patch is, and about as long as it.
OrientedBox box_along_surface(std::span<const LitPoint> points) {
  const glm::vec3 origin = points[0].position, normal = points[0].normal;
  glm::vec3 along(0);
  for (const LitPoint& point : points) {
    const glm::vec3 path = point.position - origin;
    const glm::vec3 flat = path - glm::dot(path, normal) * normal;
    if (glm::dot(flat, flat) > glm::dot(along, along)) along = flat;
  }
  if (along == glm::vec3(0)) along = glm::cross(normal, glm::vec3(normal.y, normal.z, -normal.x));
  const float length = glm::length(along);
  const glm::vec3 x = length > 0 ? along / length : glm::vec3(1, 0, 0);
  const std::array axes = {x, glm::cross(normal, x), normal};
  Box box;
  for (const LitPoint& point : points) {
    const glm::vec3 path = point.position - origin;
    box.add({glm::dot(path, axes[0]), glm::dot(path, axes[1]), glm::dot(path, axes[2])});
  }
  OrientedBox oriented{.middle = origin, .half_side = {}};
  for (int k = 0; k < 3; ++k) {
    oriented.middle += 0.5F * (box.low[k] + box.high[k]) * axes[k];
    oriented.half_side[k] = 0.5F * (box.high[k] - box.low[k]) * axes[k];
  }
  return oriented;
}

}  // namespace

Receivers::Receivers(const TransferData& data, const DirectLightingSettings& settings)
    : points_per_patch(0), area_light_samples(0) {
  const std::vector<LitPoint> points = lit_points(data, settings);
  check_settings(settings);
  points_per_patch = static_cast<std::size_t>(settings.points_per_patch);
  area_light_samples = static_cast<std::size_t>(settings.area_light_samples);
  places.resize(points_per_patch * area_light_samples);
  for (std::uint32_t k = 0; k < places.size(); ++k) places[k] = glm::vec2(r2_point(k, {0, 0}));

  std::vector<LitPoint> first;
  for (std::size_t i = 0; i < points.size(); i += points_per_patch) first.push_back(points[i]);
  for (const std::uint32_t of_patch : receiver_order(first, kPart)) {
    add_slot(of_patch, std::span(points).subspan(of_patch * points_per_patch, points_per_patch));
  }
}

void Receivers::add_slot(std::uint32_t of_patch, std::span<const LitPoint> points) {
  const std::size_t block = size() / kBlock, slot = size() % kBlock;
  if (slot == 0) {
    point.resize(point.size() + points_per_patch);
    boxes.emplace_back();
  }
  if (slot % kPart == 0) bounds.emplace_back();
  for (std::size_t k = 0; k < points_per_patch; ++k) {
    PatchPointBlock& here = point[block * points_per_patch + k];
    for (int axis = 0; axis < 3; ++axis) {
      here.position[axis][slot] = points[k].position[axis];
      here.normal[axis][slot] = points[k].normal[axis];
    }
    bounds.back().add(points[k]);
  }
  const auto [middle, side] = box_along_surface(points);
  for (int axis = 0; axis < 3; ++axis) {
    boxes[block].middle[axis][slot] = middle[axis];
    for (int k = 0; k < 3; ++k) boxes[block].side[k][axis][slot] = side[k][axis];
  }
  patch.push_back(of_patch);
  shift.emplace_back(unit_square(mix_bits(~static_cast<std::uint64_t>(of_patch))));
}

std::size_t Receivers::slots_in(std::size_t block) const {
  return std::min(kBlock, size() - block * kBlock);
}

Receivers::Reached Receivers::reached(std::size_t block, const PreparedLight& lamp) const {
  Reached reached{};
  const std::size_t first = block * reached.size();
  for (std::size_t part = 0; part < reached.size() && first + part < bounds.size(); ++part) {
    reached[part] = bounds[first + part].may_receive(lamp);
  }
  return reached;
}

}  // namespace rebounce

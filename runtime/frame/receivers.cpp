#include "runtime/frame/receivers.h"

#include <algorithm>
#include <string>

#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

void check_settings(const DirectLightingSettings& settings) {
  if (settings.light_capacity < 0) {
    throw Error("light_capacity is " + std::to_string(settings.light_capacity) +
                "; it must be at least 0");
  }
  if (settings.area_light_samples < 1 || settings.area_light_samples > kMaxAreaLightSamples) {
    throw Error("area_light_samples is " + std::to_string(settings.area_light_samples) +
                "; it must be from 1 to " + std::to_string(kMaxAreaLightSamples));
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
  if (slot == 0) point.resize(point.size() + points_per_patch);
  if (slot % kPart == 0) {
    bounds.emplace_back();
    shift.emplace_back();
  }
  for (std::size_t k = 0; k < points_per_patch; ++k) {
    PatchPointBlock& here = point[block * points_per_patch + k];
    for (int axis = 0; axis < 3; ++axis) {
      here.position[axis][slot] = points[k].position[axis];
      here.normal[axis][slot] = points[k].normal[axis];
    }
    bounds.back().add(points[k]);
  }
  patch.push_back(of_patch);
  const glm::dvec2 moved = unit_square(mix_bits(~static_cast<std::uint64_t>(of_patch)));
  for (int axis = 0; axis < 2; ++axis) {
    shift.back()[axis][slot % kPart] = static_cast<float>(moved[axis]);
  }
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

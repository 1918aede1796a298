#pragma once

#include <algorithm>
#include <glm/glm.hpp>

namespace rebounce {

/// Maps light of any brightness, where 1 is as bright as the screen's white, into [0, 1): the
/// Khronos PBR Neutral tone mapper (2024) without its Fresnel term. Linear up to a shoulder, so
/// that colours under white light are shown as they are, then all channels compressed by one
/// factor, so that hues stay, with highlights that fade to white.
inline glm::vec3 tone_curve(const glm::vec3& color) {
  constexpr float kShoulder = 0.7F;       // linear below
  constexpr float kDesaturation = 0.15F;  // how fast highlights fade to white
  const float peak = std::max({color.x, color.y, color.z});
  if (peak <= kShoulder) return color;
  constexpr float kRoom = 1 - kShoulder;
  const float new_peak = 1 - kRoom * kRoom / (peak + kRoom - kShoulder);
  const float white = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
  return glm::mix(color * (new_peak / peak), glm::vec3(new_peak), white);
}

/// How bright an emitter may be, where 1 is the screen's white, so that its edges are smooth and it
/// keeps some of its hue.
inline constexpr float kBrightestEmitter = 2;

/// `color`, hue kept, no brighter than `brightest`.
inline glm::vec3 dimmed(const glm::vec3& color, float brightest) {
  const float peak = std::max({color.x, color.y, color.z});
  return peak > brightest ? color * (brightest / peak) : color;
}

}  // namespace rebounce

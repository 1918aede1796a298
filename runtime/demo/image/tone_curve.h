#pragma once

#include <algorithm>
#include <glm/glm.hpp>

namespace rebounce {

/// Maps light of any brightness, relative to the screen's white, into [0, 1): the Khronos PBR
/// Neutral tone mapper (2024) without its Fresnel term. It is linear up to a shoulder, which keeps
/// colours under white light. Above it, one factor compresses all channels, which keeps hues;
/// highlights fade to white.
inline glm::vec3 tone_curve(const glm::vec3& color) {
  constexpr float kShoulder = 0.7F;       // linear below this
  constexpr float kDesaturation = 0.15F;  // rate at which highlights fade to white
  const float peak = std::max({color.x, color.y, color.z});
  if (peak <= kShoulder) return color;
  constexpr float kRoom = 1 - kShoulder;
  const float new_peak = 1 - kRoom * kRoom / (peak + kRoom - kShoulder);
  const float white = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
  return glm::mix(color * (new_peak / peak), glm::vec3(new_peak), white);
}

/// The largest brightness of an emitter, relative to the screen's white: its edges stay smooth and
/// it keeps some of its hue.
inline constexpr float kBrightestEmitter = 2;

/// `color` with the same hue, scaled down to at most `brightest`.
inline glm::vec3 dimmed(const glm::vec3& color, float brightest) {
  const float peak = std::max({color.x, color.y, color.z});
  return peak > brightest ? color * (brightest / peak) : color;
}

}  // namespace rebounce

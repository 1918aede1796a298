#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>

namespace rebounce {

// IEC 61966-2-1 in both directions, on [0, 1].

inline float srgb_to_linear(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

inline float linear_to_srgb(float linear) {
  return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
}

inline glm::vec3 srgb_to_linear(const glm::vec3& c) {
  return {srgb_to_linear(c.x), srgb_to_linear(c.y), srgb_to_linear(c.z)};
}

/// `threshold` in [0, 1) is the fraction between two bytes from which the upper one is used. 1/2
/// rounds; varying thresholds dither.
inline std::uint8_t to_srgb_byte(float linear, float threshold = 0.5F) {
  const float value = 255 * linear_to_srgb(std::clamp(linear, 0.0F, 1.0F));
  return static_cast<std::uint8_t>(std::min(255.0F, std::floor(value + 1 - threshold)));
}

/// Relative luminance of linear Rec.709.
inline float luminance(const glm::vec3& c) {
  return glm::dot(c, glm::vec3(0.2126F, 0.7152F, 0.0722F));
}

}  // namespace rebounce

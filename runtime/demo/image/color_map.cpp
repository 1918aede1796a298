#include "runtime/demo/image/color_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/demo/image/pixel_hash.h"
#include "runtime/demo/image/srgb.h"

namespace rebounce {

glm::vec3 viridis(float position) {
  static constexpr std::array<std::array<std::uint8_t, 3>, 9> kStops{{{68, 1, 84},
                                                                      {71, 44, 122},
                                                                      {59, 81, 139},
                                                                      {44, 113, 142},
                                                                      {33, 144, 141},
                                                                      {39, 173, 129},
                                                                      {92, 200, 99},
                                                                      {170, 220, 50},
                                                                      {253, 231, 37}}};
  const float scaled = std::clamp(position, 0.0F, 1.0F) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(scaled), kStops.size() - 2);
  const auto stop = [](std::size_t k) {
    return glm::vec3(kStops[k][0], kStops[k][1], kStops[k][2]) / 255.0F;
  };
  return srgb_to_linear(glm::mix(stop(below), stop(below + 1), scaled - static_cast<float>(below)));
}

glm::vec3 distinct_color(std::uint32_t index) {
  const float hue = hash_to_unit(index, 0);
  const float saturation = 0.35F + 0.35F * hash_to_unit(index, 1);
  const float value = 0.70F + 0.25F * hash_to_unit(index, 2);
  const auto channel = [&](float shift) {
    const float wheel = std::abs(std::fmod(6 * hue + shift, 6.0F) - 3) - 1;
    return value * (1 - saturation * (1 - std::clamp(wheel, 0.0F, 1.0F)));
  };
  return srgb_to_linear(glm::vec3(channel(0), channel(4), channel(2)));
}

}  // namespace rebounce

#include "transfer/data/opacity_maps.h"

#include <numeric>

namespace rebounce {

double OpacityMaps::stopping_part(std::uint32_t triangle) const {
  return mean_opacity(of_triangle(triangle));
}

double mean_opacity(std::span<const std::uint8_t> map) {
  if (map.empty()) return 1;
  const auto sum = std::accumulate(map.begin(), map.end(), std::uint64_t{0});
  return static_cast<double>(sum) / (static_cast<double>(OpacityMaps::kOpaque) * map.size());
}

std::uint32_t micro_triangle_at(int level, float u, float v) {
  float w = 1 - u - v;
  std::uint32_t index = 0;
  for (int k = 0; k < level; ++k) {
    index *= 4;
    if (w >= 0.5F) {
      w = 2 * w - 1, u = 2 * u, v = 2 * v;
    } else if (u >= 0.5F) {
      w = 2 * w, u = 2 * u - 1, v = 2 * v;
      index += 2;
    } else if (v >= 0.5F) {
      w = 2 * w, u = 2 * u, v = 2 * v - 1;
      index += 3;
    } else {
      w = 1 - 2 * w, u = 1 - 2 * u, v = 1 - 2 * v;
      index += 1;
    }
  }
  return index;
}

TrianglePlace place_in_micro_triangle(int level, std::uint32_t micro_triangle,
                                      TrianglePlace inside) {
  auto [u, v] = inside;
  for (int k = 0; k < level; ++k, micro_triangle /= 4) {
    switch (micro_triangle % 4) {
      case 0:
        u = u / 2, v = v / 2;
        break;
      case 1:
        u = (1 - u) / 2, v = (1 - v) / 2;
        break;
      case 2:
        u = (1 + u) / 2, v = v / 2;
        break;
      default:
        u = u / 2, v = (1 + v) / 2;
    }
  }
  return {u, v};
}

}  // namespace rebounce

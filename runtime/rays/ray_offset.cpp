#include "runtime/rays/ray_offset.h"

#include <algorithm>
#include <cmath>

namespace rebounce {

float ray_offset_distance(std::span<const Float3> position) {
  float largest = 0;
  for (const Float3& p : position) {
    for (const float x : p) largest = std::max(largest, std::abs(x));
  }
  return largest * 0x1p-18F;  // lab/006: a shorter one loses light in large rooms
}

}  // namespace rebounce

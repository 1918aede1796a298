#include "transfer/base/reflection.h"

#include <cassert>

namespace rebounce {

void add_reflected(std::span<const Float3> own, std::span<const Float3> reflectance,
                   std::span<const Float3> irradiance, std::span<Float3> exitance) {
  assert(own.size() == exitance.size() && reflectance.size() == exitance.size() &&
         irradiance.size() == exitance.size());
  for (std::size_t i = 0; i < exitance.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      exitance[i][c] = own[i][c] + reflectance[i][c] * irradiance[i][c];
    }
  }
}

void reflect(std::span<const Float3> reflectance, std::span<Float3> light) {
  assert(reflectance.size() == light.size());
  for (std::size_t i = 0; i < light.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) light[i][c] *= reflectance[i][c];
  }
}

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "rebounce/types.h"

namespace rebounce::test {

/// Light of `n` patches, each channel by itself anywhere in [0, largest).
inline std::vector<Float3> random_light(std::size_t n, std::uint64_t seed, float largest = 1) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<float> uniform(0, largest);
  std::vector<Float3> light(n);
  for (Float3& v : light) v = {uniform(engine), uniform(engine), uniform(engine)};
  return light;
}

}  // namespace rebounce::test

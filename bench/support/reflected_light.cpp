#include "bench/support/reflected_light.h"

#include <cmath>
#include <cstddef>
#include <limits>

namespace rebounce::bench {

double reflected_error(std::span<const Float3> radiosity, std::span<const Float3> truth,
                       std::span<const Float3> initial_exitance, std::span<const float> area) {
  double difference = 0, reflected = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      const double d = static_cast<double>(radiosity[i][c]) - truth[i][c];
      const double r = static_cast<double>(truth[i][c]) - initial_exitance[i][c];
      difference += area[i] * d * d;
      reflected += area[i] * r * r;
    }
  }
  if (reflected > 0) return std::sqrt(difference / reflected);
  return difference > 0 ? std::numeric_limits<double>::infinity() : 0;
}

}  // namespace rebounce::bench

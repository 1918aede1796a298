#include "runtime/demo/shading/patch_errors.h"

#include <cmath>

#include "transfer/base/area_norm.h"

namespace rebounce {

std::vector<float> patch_errors(std::span<const Float3> values, std::span<const Float3> reference,
                                std::span<const float> area) {
  double total_area = 0;
  for (const float a : area) total_area += a;
  const double rms = area_norm(reference, area) / std::sqrt(total_area);
  std::vector<float> error(reference.size(), 0.0F);
  for (std::size_t i = 0; i < error.size() && rms > 0; ++i) {
    double sum = 0;
    for (int c = 0; c < kChannelCount; ++c) {
      const double d = static_cast<double>(values[i][c]) - reference[i][c];
      sum += d * d;
    }
    error[i] = static_cast<float>(std::sqrt(sum) / rms);
  }
  return error;
}

}  // namespace rebounce

#include "precompute/base/random_signs.h"

#include <algorithm>
#include <random>

namespace rebounce {

Eigen::MatrixXf random_signs(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  constexpr Eigen::Index kBits = 64;
  std::mt19937_64 engine(seed);
  Eigen::MatrixXf signs(rows, columns);
  float* const value = signs.data();
  for (Eigen::Index k = 0; k < signs.size(); k += kBits) {
    const std::uint64_t bits = engine();
    const Eigen::Index count = std::min(kBits, signs.size() - k);
    for (Eigen::Index b = 0; b < count; ++b) value[k + b] = (bits >> b & 1) != 0 ? 1.0F : -1.0F;
  }
  return signs;
}

}  // namespace rebounce

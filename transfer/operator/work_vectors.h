#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "transfer/format/hierarchical_layout.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/operator/hierarchical_plan.h"

namespace rebounce {

/// The vectors of an apply to some lights. The positions of patches come first, then cluster
/// coefficients. Coupling matrices and dense blocks write their products over their input, which
/// saves memory traffic.
struct WorkVectors {
  /// The vectors in the workspace begin at multiples of this many floats, a cache line.
  static constexpr std::size_t kLine = 16;

  std::size_t light_count;
  PlanarVectors<float> x;           ///< [positions] exitance times the root of the area
  Coefficients<float> coefficient;  ///< of x in the bases, later of y
  PlanarVectors<float> scratch;     ///< input copies of the coupling matrices, for each part
  PlanarVectors<float> y;           ///< [positions] what arrives
  LightRun* runs;                   ///< [lights][run_count] measures of x

  WorkVectors(std::size_t positions, const HierarchicalLayout& layout, std::size_t lights,
              float* buffer)
      : light_count(lights) {
    const std::size_t vector = vector_size(positions, layout);
    const std::size_t coefficients = coefficients_size(layout);
    const auto take = [&](std::size_t size) { return std::exchange(buffer, buffer + size); };
    x = {take(kChannelCount * light_count * vector), vector, kChannelCount * light_count};
    coefficient = {take(light_count * coefficients), coefficients};
    scratch = {take(kParts * layout.largest_scratch), layout.largest_scratch, kParts};
    y = {take(kChannelCount * light_count * vector), vector, kChannelCount * light_count};
    runs = reinterpret_cast<LightRun*>(take(light_count * runs_size(vector)));
  }

  /// The measures of a light from a position on.
  LightRun* runs_at(std::size_t light, std::size_t position) const {
    return runs + (light * x.stride + position) / LightRun::kPositions;
  }

  static std::size_t size(std::size_t positions, const HierarchicalLayout& layout,
                          std::size_t light_count) {
    const std::size_t vector = vector_size(positions, layout);
    return (2 * kChannelCount * vector + coefficients_size(layout) + runs_size(vector)) *
               light_count +
           kParts * layout.largest_scratch;
  }

 private:
  static constexpr std::size_t kParts = HierarchicalPlan::kMostParts;

  static std::size_t round_up(std::size_t size) { return (size + kLine - 1) / kLine * kLine; }

  static std::size_t vector_size(std::size_t positions, const HierarchicalLayout& layout) {
    return round_up(positions + layout.cluster_coefficient_count);
  }
  /// In floats, for a vector of this size.
  static std::size_t runs_size(std::size_t vector) {
    return vector / LightRun::kPositions * (sizeof(LightRun) / sizeof(float));
  }
  static std::size_t coefficients_size(const HierarchicalLayout& layout) {
    return round_up(layout.coefficient_count * kChannelLanes);
  }
};

inline PlanarVectors<const float> constant(const PlanarVectors<float>& vectors) {
  return {vectors.data, vectors.stride, vectors.count};
}

inline Coefficients<const float> constant(const Coefficients<float>& coefficients) {
  return {coefficients.data, coefficients.stride};
}

/// Sets entries [begin, end) of all vectors to 0.
inline void clear(const PlanarVectors<float>& vectors, std::size_t begin, std::size_t end) {
  for (std::size_t v = 0; v < vectors.count; ++v) {
    float* const data = vectors.data + v * vectors.stride;
    std::fill(data + begin, data + end, 0.0F);
  }
}

}  // namespace rebounce

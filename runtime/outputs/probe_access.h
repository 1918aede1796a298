#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "rebounce/error.h"
#include "rebounce/scene_data.h"

namespace rebounce {

/// Throws Error if there are no probes.
inline void check_probes(const LightProbes& probes) {
  if (probes.size() == 0) {
    throw Error("the transfer file has no light probes; make it with --probes");
  }
}

/// The position of a coordinate in a row of evenly spaced probes.
struct GridPlace {
  std::uint32_t low = 0, high = 0;
  float fraction = 0;
};

inline GridPlace place_in_row(float x, float first, float last, std::uint32_t count) {
  if (count < 2 || !(last > first)) return {};
  const auto end = static_cast<float>(count - 1);
  const float along = (x - first) / (last - first) * end;
  const float at = along > 0 ? std::min(along, end) : 0;  // 0 for what is no number too
  const auto low = std::min(static_cast<std::uint32_t>(at), count - 2);
  return {low, low + 1, at - static_cast<float>(low)};
}

/// Calls visit(probe, weight) for the valid ones of the eight probes around `position`, with
/// trilinear weights. Returns the sum of the weights; 0 if the probes are not a grid.
template <typename Visit>
float for_each_probe_around(const LightProbes& probes, const Float3& position, const Visit& visit) {
  const auto [nx, ny, nz] = probes.grid;
  if (nx == 0) return 0;
  const Float3& first = probes.position.front();
  const Float3& last = probes.position.back();
  std::array<GridPlace, 3> place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    place[axis] = place_in_row(position[axis], first[axis], last[axis], probes.grid[axis]);
  }
  float total = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    float weight = 1;
    std::array<std::uint32_t, 3> at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool high = (corner >> axis & 1U) != 0;
      weight *= high ? place[axis].fraction : 1 - place[axis].fraction;
      at[axis] = high ? place[axis].high : place[axis].low;
    }
    const std::size_t probe = at[0] + std::size_t{nx} * (at[1] + std::size_t{ny} * at[2]);
    if (weight <= 0 || probes.valid[probe] == 0) continue;
    total += weight;
    visit(probe, weight);
  }
  return total;
}

}  // namespace rebounce

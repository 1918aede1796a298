#pragma once

#include <cstdint>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A point on a surface that emits.
struct EmitterPoint {
  Float3 position;
  Float3 area;  ///< unit normal of the front times the area that the point stands for, m²
};

/// Points spread over one patch that emits.
struct EmitterPoints {
  std::uint32_t patch = 0;
  std::vector<EmitterPoint> point;
};

/// Points on each patch of `data` that emits, in the order of the patches. There are `most_each`
/// points on a patch; fewer, but at least one, if there would be more than `most` in all.
/// Deterministic.
std::vector<EmitterPoints> spread_over_emitters(const TransferData& data, int most_each, int most);

}  // namespace rebounce

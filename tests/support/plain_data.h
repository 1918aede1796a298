#pragma once

#include <utility>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// Patches of these areas in no particular place, none of which sees another; no operator.
inline TransferData plain_data(std::vector<float> area) {
  const std::size_t n = area.size();
  TransferData data;
  data.patches.area = std::move(area);
  data.patches.centroid.assign(n, {0, 0, 0});
  data.patches.normal.assign(n, {0, 1, 0});
  data.patches.reflectance.assign(n, {0.5F, 0.25F, 0.5F});
  data.patches.emitted_exitance.assign(n, {0, 0, 0});
  data.patches.sky_visibility.assign(n, 0.0F);
  data.patches.absorbed.assign(n, 0.0F);
  data.mesh.weight_begin = {0};
  data.exchange = {SharedArray(std::vector<std::uint64_t>(n + 1)), {}, {}};
  return data;
}

}  // namespace rebounce::test

// Where patches look for direct light. Callers that bring it need the points too.

#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_offset.h"
#include "runtime/rays/sampling.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

std::vector<ReceiverPoint> receiver_points(const TransferData& data,
                                           const DirectLightingSettings& settings) {
  if (settings.points_per_patch < 1) {
    throw Error("points_per_patch is " + std::to_string(settings.points_per_patch) +
                "; it must be at least 1");
  }
  const auto points_per_patch = static_cast<std::size_t>(settings.points_per_patch);
  const std::size_t n = data.patches.size();
  const float offset = ray_offset_distance(data.mesh.position);
  const PatchTriangles triangles(data.mesh.triangle_patch, n);
  std::vector<ReceiverPoint> points(n * points_per_patch);
  std::vector<PatchPoint> spread(points_per_patch);
  for (std::size_t i = 0; i < n; ++i) {
    std::ranges::fill(spread, PatchPoint{data.patches.centroid[i], data.patches.normal[i]});
    if (!triangles[i].empty()) {
      spread_points(data.mesh, triangles[i], unit_square(mix_bits(i)), spread);
    }
    for (std::size_t k = 0; k < points_per_patch; ++k) {
      const auto& [position, normal] = spread[k];
      points[i * points_per_patch + k] = {offset_along(position, normal, offset), normal};
    }
  }
  return points;
}

}  // namespace rebounce

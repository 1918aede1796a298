#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/outputs/receiver_views.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// Light at vertices by rows of single patches, as rays find them, neither rounded nor in sets.
class ExactLight {
 public:
  /// Looks from each vertex that may have a row, and from each patch. `data` must outlive it.
  ExactLight(const TransferData& data, const RayTracer& tracer, int ray_count);

  /// Those that see something, ascending.
  std::span<const std::uint32_t> vertices() const { return vertices_; }

  /// The light [v] in lx at vertices(), under patches of `indirect` irradiance and `radiosity` [n]
  /// in lx: that of their weights, and what their rows add to it.
  std::vector<Float3> light(std::span<const Float3> indirect,
                            std::span<const Float3> radiosity) const;

 private:
  const TransferData& data_;
  std::vector<std::uint32_t> vertices_;
  std::vector<ViewRow> of_vertex_;  ///< of each of vertices_
  std::vector<ViewRow> of_patch_;   ///< [n]
};

}  // namespace rebounce::bench

#pragma once

// What of the error of patch means is made where: in one bounce, by taking patches as evenly
// bright, and by the form factors between them.

#include <span>
#include <vector>

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::reference {

/// Light that patches would get if all of them were as bright as in truth, but evenly so.
struct OneBounce {
  std::vector<Float3> gathered;  ///< [n] by the form factors: F B, lx
  std::vector<Float3> traced;    ///< [n] along rays, which know F exactly but for their noise, lx
};

/// `radiosity` [n] is the truth's, lx; `tracer` holds the first surface_count triangles of
/// `data.mesh`; `ray_count` cosine-distributed rays leave each patch. `traced` - truth is what
/// patches of even light cost a patch in its last bounce, `gathered` - `traced` what the form
/// factors cost it. Throws Error if the sizes do not agree.
OneBounce find_one_bounce(const TransferData& data, const RayTracer& tracer,
                          std::span<const Float3> radiosity, int ray_count, std::uint64_t seed);

}  // namespace rebounce::reference

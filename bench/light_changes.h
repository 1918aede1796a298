#pragma once

#include <string>
#include <vector>

#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce::bench {

/// The light before and after a change: what patches give off first, [n] in lx. Before a cold start
/// there is none.
struct LightChange {
  std::string name;
  std::vector<Float3> before, after;
};

/// One lamp in the free space of the scene: switched on in the dark, moved by 1, 5 and 20 % of the
/// scene's diagonal, and replaced by another one elsewhere. Throws Error if it lights nothing.
std::vector<LightChange> light_changes(const TransferData& data);

}  // namespace rebounce::bench

#pragma once

#include <vector>

#include "rebounce/lights.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Emitting surface that is as well described by rectangle lamps.
struct EmittingRectangles {
  std::vector<Light> lamps;
  std::vector<bool> is_lamp;  ///< [n] patches that one of them stands for

  /// Whether there is emitting surface that is none of them.
  bool leave_any(const TransferData& data) const;
};

/// Finds the flat connected pieces of emitting surface that are rectangles to a thousandth, of one
/// material without an emissive texture: the `most` that give off the most light.
EmittingRectangles find_emitting_rectangles(const TransferData& data, std::size_t most);

}  // namespace rebounce

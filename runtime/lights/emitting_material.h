#pragma once

#include <cstdint>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The material that each patch [n] emits by: that of the largest of its triangles whose material
/// emits, or kNone.
std::vector<std::uint32_t> find_emitting_material(const TransferData& data);

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The emitting material of each patch [n], the one that covers most of it, or kNone.
std::vector<std::uint32_t> find_emitting_material(const TransferData& data);

}  // namespace rebounce

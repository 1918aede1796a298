#pragma once

#include <cstdint>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Whether a patch emits light.
inline bool emits(const PatchTable& patches, std::uint32_t patch) {
  return patches.emitted_exitance[patch] != Float3{0, 0, 0};
}

/// The emitting material of each patch [n], the one that covers most of it, or kNone.
std::vector<std::uint32_t> find_emitting_material(const TransferData& data);

}  // namespace rebounce

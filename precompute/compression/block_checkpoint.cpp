#include "precompute/compression/block_checkpoint.h"

#include <type_traits>

namespace rebounce {

static_assert(std::is_trivially_copyable_v<TransferBlock> &&
              sizeof(TransferBlock) == 10 * sizeof(std::uint32_t));

void BlockCheckpoint::keep(const std::string& name, const BlockPart& part) const {
  parts_.keep(name, part.blocks, part.values);
}

std::optional<BlockPart> BlockCheckpoint::find(const std::string& name) const {
  BlockPart part;
  if (!parts_.find(name, part.blocks, part.values)) return std::nullopt;
  return part;
}

}  // namespace rebounce

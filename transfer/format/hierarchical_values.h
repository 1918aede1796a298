#pragma once

#include <cstdint>
#include <vector>

#include "transfer/format/hierarchical_layout.h"

namespace rebounce {

/// The same operator with its values in f32, in the order kStreamed. Throws Error if `storage` is
/// not valid.
HierarchicalStorage decode(const HierarchicalStorage& storage);

/// The entries of one block and one matrix, expanded to positions where the block is over cluster
/// coefficients.
struct BlockOfPositions {
  std::vector<std::uint32_t> rows, columns;
  std::vector<double> entries;  ///< [rows][columns]
};

/// The entries of block `index` for one matrix. `storage` has the order kStreamed and `layout` is
/// its layout; the block is not a cluster basis itself.
BlockOfPositions block_of_positions(const HierarchicalStorage& storage,
                                    const HierarchicalLayout& layout, std::size_t block,
                                    std::uint32_t matrix);

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <vector>

#include "transfer/format/hierarchical_layout.h"

namespace rebounce {

/// What the values of an operator stand for, in f32 and in the order kStreamed.
HierarchicalStorage decode(const HierarchicalStorage& storage);

/// The entries of one block, of one matrix, between the positions whose light it takes, directly or
/// as cluster coefficients.
struct BlockOfPositions {
  std::vector<std::uint32_t> rows, columns;
  std::vector<double> entries;  ///< [rows][columns]
};

/// Of a block that is not of cluster coefficients itself; values in the order kStreamed.
BlockOfPositions block_of_positions(const HierarchicalStorage& storage,
                                    const HierarchicalLayout& layout, std::size_t block,
                                    std::uint32_t matrix);

}  // namespace rebounce

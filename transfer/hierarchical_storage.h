#pragma once

#include <cstdint>
#include <vector>

#include "hierarchical_layout.h"

namespace rebounce {

/// Throws Error if the tables or the number of values are not those of an operator.
void check_hierarchical_storage(const HierarchicalOperator::Storage& storage);

/// A core's or a dense block's entry in half precision. Throws Error if it is beyond its range.
std::uint16_t encode_core_value(float value);

/// Blocks as a precision without remainders has them.
void drop_remainders(HierarchicalOperator::Storage& storage);

/// What products of stored values must be multiplied by.
float product_scale(Precision precision);

/// What the values of an operator stand for, in f32 and in the order kStreamed.
HierarchicalOperator::Storage decode(const HierarchicalOperator::Storage& storage);

/// The entries of one block, [row_count][column_count], of one matrix; values in the order
/// kStreamed.
std::vector<double> block_entries(const HierarchicalOperator::Storage& storage,
                                  const HierarchicalLayout& layout, std::size_t block,
                                  std::uint32_t matrix);

}  // namespace rebounce

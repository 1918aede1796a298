#pragma once

#include <cstdint>

#include "rebounce/transfer/hierarchical_operator.h"

namespace rebounce {

/// Throws Error if the tables or the number of values are not those of an operator.
void check_hierarchical_storage(const HierarchicalOperator::Storage& storage);

/// A core's or a dense block's entry in half precision. Throws Error if it is beyond its range.
std::uint16_t encode_core_value(float value);

/// Blocks as a precision without remainders has them.
void drop_remainders(HierarchicalOperator::Storage& storage);

/// R at a position that holds a patch.
float position_scale(const HierarchicalOperator::Storage& storage, std::size_t position);

/// What products of stored values must be multiplied by.
float product_scale(Precision precision);

}  // namespace rebounce

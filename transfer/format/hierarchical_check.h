#pragma once

#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Throws Error if the tables or the number of values are not those of an operator.
void check_hierarchical_storage(const HierarchicalStorage& storage);

}  // namespace rebounce

#pragma once

#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Throws Error if the tables or the number of values do not describe a valid operator.
void check_hierarchical_storage(const HierarchicalStorage& storage);

}  // namespace rebounce

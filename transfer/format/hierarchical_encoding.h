#pragma once

#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// The same operator with its values in the order kStreamed. A low-rank block that has only one
/// rank loses it. Throws Error if the tables or the number of values are not those of an operator.
HierarchicalStorage stream_values(const HierarchicalStorage& storage);

/// Values in f32 as `precision` has them, in the order kStreamed; in 8 bits with the residuals
/// that its blocks ask for. Where there are scales of positions, all of them grow as far as entries
/// would be beyond the range of halves. Throws Error if the values are not in f32 or one is still
/// beyond it, and as stream_values does.
HierarchicalStorage encode_values(const HierarchicalStorage& storage, Precision precision);

}  // namespace rebounce

#pragma once

#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// The same operator with its values in the order kStreamed. A low-rank block with only one rank
/// above zero gets rank zero. Throws Error if the tables or the number of values are not valid.
HierarchicalStorage stream_values(HierarchicalStorage storage);

/// Rounds values in f32 to `precision` and writes them in the order kStreamed. In 8 bits the result
/// has the residuals that its blocks ask for. If the operator has scales of positions, these grow
/// as far as is needed to bring all entries into the range of halves. Throws Error if the values
/// are not in f32, if they are in the order kStreamed and to be in another precision, if an entry
/// is still out of range, or as stream_values does.
HierarchicalStorage encode_values(const HierarchicalStorage& storage, Precision precision);

}  // namespace rebounce

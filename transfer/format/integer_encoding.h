#pragma once

#include <cstdint>

#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// A core's or a dense block's entry in half precision. Throws Error if it is beyond its range.
std::uint16_t encode_core_value(float value);

/// Blocks as a precision without remainders has them.
void drop_remainders(HierarchicalStorage& storage);

/// An operator in f32 and in the order kStreamed with integers for its bases, of `precision` kQ16
/// or kQ8, the latter with the remainders that its blocks ask for. The scales of their vectors go
/// into the cores, which become f16. Throws Error if a core is beyond half precision.
HierarchicalStorage encode_integers(const HierarchicalStorage& exact, Precision precision);

}  // namespace rebounce

#pragma once

#include "rebounce/transfer/hierarchical_operator.h"

namespace rebounce {

/// An operator in f32 and in the order kStreamed with integers for its bases, of `precision` kQ16
/// or kQ8, the latter with the remainders that its blocks ask for. The scales of their vectors go
/// into the cores, which become f16. Throws Error if a core is beyond half precision.
HierarchicalOperator::Storage encode_integers(const HierarchicalOperator::Storage& exact,
                                              Precision precision);

}  // namespace rebounce

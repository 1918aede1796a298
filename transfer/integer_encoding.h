#pragma once

#include "rebounce/transfer/hierarchical_operator.h"

namespace rebounce {

/// An operator in f32 and in the order kStreamed with integers for its bases, of `precision` kQ16
/// or kQ8. The scales of their vectors go into the cores, which become f16.
///
/// In 16 bits every vector of a basis is rounded. In 8 bits too, and the first ones, with which the
/// largest entries go, have remainders, as many as are worth their bytes: where a value of them
/// removes more squared error than a usual value of the last ranks that were kept. Throws Error if
/// a core is beyond half precision.
HierarchicalOperator::Storage encode_integers(const HierarchicalOperator::Storage& exact,
                                              Precision precision);

}  // namespace rebounce

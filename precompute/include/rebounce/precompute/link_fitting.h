#pragma once

#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/linked_form_factors.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// Links between the same nodes, with the form factors of all pairs: each is the least squares of
/// its pairs, so that what nodes exchange and, after scaling, what each patch gathers of uniform
/// light are those of the pairs. What rays of the links were off is gone; where links are was a
/// matter of geometry. Links without any light are left out.
///
/// `links` and `exchange` are over the n patches; only single patches are linked to themselves, as
/// build_links has it. The same bits for any number of threads. The work
/// is that of sorting the pairs and a look at each; it takes 8 bytes for each. Throws Error if the
/// sizes differ or `links` are damaged.
FormFactorLinks fit_links(const FormFactorLinks& links, const ExchangeMatrix& exchange,
                          const PatchTable& patches);

}  // namespace rebounce

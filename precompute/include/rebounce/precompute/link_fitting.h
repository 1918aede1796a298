#pragma once

#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/linked_form_factors.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// Links for hierarchical radiosity from the form factors of all pairs: the largest blocks of pairs
/// whose exchange is affine over either node but for `epsilon`, of the part of the symmetric form
/// A^1/2 F A^-1/2 that a link stands for, Frobenius, absolute, as FormFactorSettings::link_epsilon.
/// Each link is the least squares of its pairs, so that what nodes exchange and, after scaling,
/// what each patch gathers of uniform light are those of the pairs; nothing is traced again.
///
/// `exchange` is over the n patches. The same bits for any number of threads. The work is that of
/// sorting the pairs; it takes 12 bytes for each. Throws Error if the sizes differ or `epsilon` is
/// negative or not finite.
FormFactorLinks fit_links(const ExchangeMatrix& exchange, const PatchTable& patches,
                          double epsilon);

}  // namespace rebounce

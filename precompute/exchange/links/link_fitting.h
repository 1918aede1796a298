#pragma once

#include <memory>

#include "precompute/base/progress.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Default of `error_per_link` (fit_links). lab/015: larger ones leave errors above those of links.
inline constexpr double kErrorPerLink = 7e-4;

/// Fits links to the form factors of all pairs, as few as possible for their error.
///
/// Each link is the least-squares fit of its pairs. The exchange of two nodes and, after scaling,
/// the light that each patch gathers under uniform light are therefore those of the pairs. Dynamic
/// programming, within blocks of 128 by 128 patches, compares all ways to cut the pairs into pairs
/// of nodes by splitting either node again and again. It finds the way with the least squared error
/// plus multiplier for each link: the Lagrangian form of "fewest links for a given error". The
/// error is that of A^1/2 F A^-1/2 in the Frobenius norm. The multiplier is the square of
/// `error_per_link`, times the squared norm per patch. A larger `error_per_link` gives fewer links
/// and more error, which grows about with its power 0.8.
///
/// Pairs without light have no link, and no link joins rooms that light cannot pass between. The
/// bits do not depend on the number of threads. Takes 8 bytes for each pair, and examines 5 to 20 %
/// of the pairs of nodes. Throws Error if `exchange` and the n patches differ in number or
/// `error_per_link` is not above 0 and finite, Cancelled if `progress` asks to stop.
FormFactorLinks fit_links(const ExchangeMatrix& exchange, const PatchTable& patches,
                          double error_per_link = kErrorPerLink, const Progress& progress = {});

/// Fits links to the pairs that other links stand for. Refinement makes far more links than
/// necessary: it splits nodes before it knows the result, and splits down to patches where row sums
/// are doubtful. Nothing with n² entries is stored. Throws Error if `links` are not of these
/// patches.
FormFactorLinks fit_links(const std::shared_ptr<const LinkedFormFactors>& links,
                          const PatchTable& patches, double error_per_link = kErrorPerLink,
                          const Progress& progress = {});

}  // namespace rebounce

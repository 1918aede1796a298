#pragma once

#include "precompute/base/progress.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// What a fitted link must be worth by default: see fit_links. Measured: notes/links.md.
inline constexpr double kErrorPerLink = 7e-4;

/// Links for the form factors of all pairs, as few as possible for their error.
///
/// Each link is the least squares of its pairs, so that what nodes exchange and, after scaling,
/// what each patch gathers of uniform light are those of the pairs. Of all ways to cut the pairs
/// into pairs of nodes, by splitting either node again and again, that of the least squared error
/// plus multiplier for each link is found (by dynamic programming, within blocks of 256 patches by
/// 256): the Lagrangian form of "fewest links for a given error". The error is that of A^1/2 F
/// A^-1/2, Frobenius; the multiplier is the square of `error_per_link` times the mean that a patch
/// has of its square. A larger worth means fewer links and more error, which grows about like its
/// power 0.8.
///
/// Pairs without light have no link, and no link takes light from one room to another that light
/// cannot reach on any way. The same bits for any number of threads. It takes 8 bytes for
/// each pair and the time of a look at some twentieth to fifth of the pairs of nodes. Throws Error
/// if `exchange` and the n patches differ in number or `error_per_link` is not above 0 and finite,
/// Cancelled when `progress` says so.
FormFactorLinks fit_links(const ExchangeMatrix& exchange, const PatchTable& patches,
                          double error_per_link = kErrorPerLink, const Progress& progress = {});

/// The same for the pairs that other links stand for, of which far more than needed come from
/// refinement: it splits where it cannot know yet, and what row sums make doubtful down to patches.
/// Nothing of n² entries is kept. Throws Error if `links` are damaged or not of these patches.
FormFactorLinks fit_links(const FormFactorLinks& links, const PatchTable& patches,
                          double error_per_link = kErrorPerLink, const Progress& progress = {});

}  // namespace rebounce

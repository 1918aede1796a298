#pragma once

#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/inverse/shared_bases.h"
#include "precompute/inverse/solved_transfer.h"

namespace rebounce {

/// Positions in a cell of the bases.
inline constexpr std::uint32_t kBasisCell = 512;  // lab/108: larger ones gain little

/// Bases for Z = Yhat - G, the light of all bounces but the first, over `cells` of the tree of
/// `frame`, found from the light that random vectors send (N. Halko, P. G. Martinsson and J. A.
/// Tropp, "Finding structure with randomness", 2011, section 4.4; J. Levitt and P. G. Martinsson,
/// "Linear-complexity black-box randomized compression of rank-structured matrices", 2022).
///
/// Errors count by the weights of the cells, as in the compression. A basis has the leading
/// directions of the samples over its cell. Their energies are those of further samples, which the
/// directions do not depend on. The ranks are the smallest, of all cells together, with which
/// indirect light errs by `tolerance` in the root mean square over lights like those of `frame`, of
/// which half is where light comes from and half where it arrives. More samples are drawn until
/// they are three times the usual rank. The bits do not depend on the number of threads. Throws
/// Cancelled if asked to stop.
SharedBases sample_bases(const SolvedTransfer& solved, const CompressionFrame& frame,
                         const std::vector<std::uint32_t>& cells, double tolerance,
                         const Progress& progress = {});

}  // namespace rebounce

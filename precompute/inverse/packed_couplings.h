#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/inverse/shared_bases.h"

namespace rebounce {

/// The couplings of a cell, rounded to multiples of the step of their matrix and packed: groups of
/// neighbours in integers of as many bytes as they need, or in floats where integers would be too
/// large. Most couplings are far smaller than the few large ones, so that a step for all takes
/// about a byte for each.
using PackedCouplings = std::vector<std::uint8_t>;

/// `couplings`: SharedBases::coupling_count(cell) values. A cell's couplings with itself become
/// symmetric.
PackedCouplings pack_couplings(const SharedBases& bases, std::size_t cell,
                               std::span<const float> couplings);

/// C_dc for d >= c, [coupled rank of d][coupled rank of c], from the packed couplings of c.
Eigen::MatrixXf unpack_coupling(const SharedBases& bases, std::size_t matrix, std::size_t d,
                                std::size_t c, const PackedCouplings& couplings);

}  // namespace rebounce

#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace rebounce {

/// Numbers that are 1 or -1, each with the same probability and independent of the others. The same
/// for the same seed.
Eigen::MatrixXf random_signs(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed);

}  // namespace rebounce

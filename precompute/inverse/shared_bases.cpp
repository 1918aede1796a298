#include "precompute/inverse/shared_bases.h"

namespace rebounce {

using Eigen::Index;

Index SharedBases::ranks_between(std::size_t matrix, std::size_t from, std::size_t to) const {
  Index sum = 0;
  for (std::size_t cell = from; cell < to; ++cell) sum += rank(matrix, cell);
  return sum;
}

std::size_t SharedBases::coupling_begin(std::size_t matrix, std::size_t cell) const {
  Index sum = 0;
  for (std::size_t m = 0; m < matrix; ++m) {
    sum += ranks_between(m, cell, cell_count()) * rank(m, cell);
  }
  return static_cast<std::size_t>(sum);
}

std::size_t SharedBases::coupling_count(std::size_t cell) const {
  return coupling_begin(bases.size(), cell);
}

Eigen::Map<const Eigen::MatrixXf, 0, Eigen::OuterStride<>> SharedBases::coupling(
    std::size_t matrix, std::size_t d, std::size_t c, std::span<const float> couplings) const {
  const Index rows = ranks_between(matrix, c, cell_count());
  const float* const first = couplings.data() + coupling_begin(matrix, c);
  return {first + ranks_between(matrix, c, d), rank(matrix, d), rank(matrix, c),
          Eigen::OuterStride<>(rows)};
}

}  // namespace rebounce

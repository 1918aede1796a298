#include "precompute/inverse/shared_bases.h"

namespace rebounce {

std::size_t SharedBases::couplings_between(std::size_t matrix, std::size_t cell,
                                           std::size_t to) const {
  std::size_t sum = 0;
  for (std::size_t d = cell; d < to; ++d) sum += coupling_size(matrix, d, cell);
  return sum;
}

std::size_t SharedBases::coupling_begin(std::size_t matrix, std::size_t cell) const {
  std::size_t sum = 0;
  for (std::size_t m = 0; m < matrix; ++m) sum += couplings_between(m, cell, cell_count());
  return sum;
}

std::size_t SharedBases::coupling_count(std::size_t cell) const {
  return coupling_begin(bases.size(), cell);
}

Eigen::Map<const Eigen::MatrixXf> SharedBases::coupling(std::size_t matrix, std::size_t d,
                                                        std::size_t c,
                                                        std::span<const float> couplings) const {
  const float* const first = couplings.data() + coupling_begin(matrix, c);
  return {first + couplings_between(matrix, c, d), coupled_rank(matrix, d, c),
          coupled_rank(matrix, c, d)};
}

}  // namespace rebounce

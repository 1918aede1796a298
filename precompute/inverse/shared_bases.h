#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rebounce {

/// Bases in which a symmetric matrix Z of each distinct channel is small. The patches lie in cells,
/// and all blocks over a cell share its basis (the format BLR²: C. Ashcraft, A. Buttari and T.
/// Mary, "Block low-rank matrices with shared bases: potential and limitations of the BLR² format",
/// 2021). Between the cells d and c,
///
///   Z_dc ~ E_d C_dc E_c^T  with  C_dc = D_d^T Z_dc D_c  and  D^T E = I.
struct SharedBases {
  /// Of one matrix over one cell, both [patches of the cell][rank].
  struct Basis {
    Eigen::MatrixXf lights;   ///< D: light that is sent to find the couplings
    Eigen::MatrixXf vectors;  ///< E
  };

  std::vector<std::vector<std::uint32_t>> patches;  ///< of each cell
  std::vector<std::vector<Basis>> bases;            ///< [matrices][cells]
  /// Couplings are rounded to multiples of it, [matrices]; 0: not at all.
  std::vector<double> step;
  std::size_t sample_count = 0;  ///< vectors whose light they were found from

  std::size_t cell_count() const { return patches.size(); }
  Eigen::Index rank(std::size_t matrix, std::size_t cell) const {
    return bases[matrix][cell].vectors.cols();
  }
  /// The ranks of the cells from one to another, without the latter.
  Eigen::Index ranks_between(std::size_t matrix, std::size_t from, std::size_t to) const;

  /// The couplings of a cell c are C_dc of all cells d from c on, one below the other, of each
  /// matrix: [matrices][rank of c][ranks of all d]. This is the number of their values.
  std::size_t coupling_count(std::size_t cell) const;
  /// The first of those of one matrix.
  std::size_t coupling_begin(std::size_t matrix, std::size_t cell) const;

  /// C_dc among the couplings of c, for d >= c.
  Eigen::Map<const Eigen::MatrixXf, 0, Eigen::OuterStride<>> coupling(
      std::size_t matrix, std::size_t d, std::size_t c, std::span<const float> couplings) const;
};

}  // namespace rebounce

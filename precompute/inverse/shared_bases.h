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
///
/// Between cells of different groups, only the first vectors of both count.
struct SharedBases {
  /// Of one matrix over one cell, both [patches of the cell][rank].
  struct Basis {
    Eigen::MatrixXf lights;   ///< D: light that is sent to find the couplings
    Eigen::MatrixXf vectors;  ///< E
    /// The first vectors, with which light goes to and from cells of other groups.
    Eigen::Index far_rank = 0;
  };

  std::vector<std::vector<std::uint32_t>> patches;  ///< of each cell
  std::vector<std::vector<Basis>> bases;            ///< [matrices][cells]
  std::vector<std::uint32_t> group;                 ///< of each cell; empty if all are of one group
  /// Couplings are rounded to multiples of it, [matrices]; 0: not at all.
  std::vector<double> step;
  std::size_t sample_count = 0;  ///< vectors whose light they were found from

  std::size_t cell_count() const { return patches.size(); }
  Eigen::Index rank(std::size_t matrix, std::size_t cell) const {
    return bases[matrix][cell].vectors.cols();
  }
  bool are_together(std::size_t c, std::size_t d) const {
    return group.empty() || group[c] == group[d];
  }
  /// The number of vectors of a cell that are coupled with those of cell `other`.
  Eigen::Index coupled_rank(std::size_t matrix, std::size_t cell, std::size_t other) const {
    return are_together(cell, other) ? rank(matrix, cell) : bases[matrix][cell].far_rank;
  }

  /// The couplings of a cell c are C_dc of all cells d from c on, one after the other, of each
  /// matrix. This is the number of their values.
  std::size_t coupling_count(std::size_t cell) const;
  /// The first of those of one matrix.
  std::size_t coupling_begin(std::size_t matrix, std::size_t cell) const;
  /// The number of values of C_dc.
  std::size_t coupling_size(std::size_t matrix, std::size_t d, std::size_t c) const {
    return static_cast<std::size_t>(coupled_rank(matrix, d, c) * coupled_rank(matrix, c, d));
  }

  /// C_dc among the couplings of c, for d >= c.
  Eigen::Map<const Eigen::MatrixXf> coupling(std::size_t matrix, std::size_t d, std::size_t c,
                                             std::span<const float> couplings) const;

 private:
  /// The number of values of the couplings of a cell with those from it to another, without it.
  std::size_t couplings_between(std::size_t matrix, std::size_t cell, std::size_t to) const;
};

}  // namespace rebounce

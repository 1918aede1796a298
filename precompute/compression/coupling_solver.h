#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/compression/block_checkpoint.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/inverse/packed_couplings.h"
#include "precompute/inverse/shared_bases.h"
#include "precompute/inverse/solved_transfer.h"

namespace rebounce {

/// The cells of shared bases, as clusters of the tree of a frame.
struct FramedCells {
  const CompressionFrame& frame;
  std::span<const std::uint32_t> clusters;
};

/// The number of couplings that are wanted: those of cells in whose columns an entry on or below
/// the diagonal is, by the roles of the frame.
std::uint64_t coupling_count(const SharedBases& bases, const FramedCells& cells);

/// Solves for the couplings of shared bases, some cells at a time.
///
/// Vectors that light goes to other groups with are solved for one by one. What the others of a
/// group send hardly leaves it, so that one vector of each group shares a solve.
class CouplingSolver {
 public:
  /// Finds the cells that `checkpoint` holds. `solved`, `bases` and `checkpoint` must outlive the
  /// object. `cells_together` > 0 cells of each group, or a few more, are solved for at the same
  /// time; the bits do not depend on it. Ranks take runs of so many cells in turns.
  CouplingSolver(const SolvedTransfer& solved, const SharedBases& bases, const FramedCells& cells,
                 std::size_t cells_together, const BlockCheckpoint& checkpoint);

  /// The solves for all wanted cells, whoever makes them.
  std::size_t solve_count() const;

  /// The solves that this rank has to make.
  double work() const;

  /// Does the work and keeps the couplings of every cell in the checkpoint. Returns those of all
  /// cells, empty where they are not wanted. Call it once. Throws Cancelled if asked to stop.
  std::vector<PackedCouplings> run(const Progress& progress);

 private:
  /// Neighbouring vectors of the basis of a cell, and the first of their columns in a pack.
  struct Part {
    std::size_t cell;
    Eigen::Index begin, count, column;
  };

  /// What one thread solves for. Which vectors follows from the bases alone, as the bits of a
  /// product depend on its width.
  struct Pack {
    std::uint32_t matrix;
    std::vector<Part> parts;
    Eigen::Index width = 0;
  };

  /// Packs that are filled column by column.
  class Packs;

  bool is_missing(std::size_t cell) const;
  bool is_missing(const Pack& pack) const;
  std::span<const std::size_t> cells_of_run(std::size_t first, std::size_t count) const;
  double work_of(std::size_t first) const;  ///< of the run that begins with this one
  std::vector<Pack> packs_of(std::size_t first, bool all = false) const;
  std::vector<Pack> packs_of(std::span<const std::size_t> cells, std::uint32_t matrix) const;
  void solve_run(std::size_t first, const Progress& progress);
  void solve(const Pack& pack, SolvedTransfer::Workspace& workspace);
  void keep(std::uint32_t matrix, const Part& part, std::size_t d, const Eigen::MatrixXf& found,
            std::size_t offset);
  void share_packed();

  const SolvedTransfer& solved_;
  const SharedBases& bases_;
  std::vector<bool> is_wanted_;
  std::vector<std::size_t> order_;  ///< of the cells: the first of each group, then the second
  std::size_t packed_together_;     ///< cells whose vectors are packed together
  std::size_t together_;            ///< cells of a run
  const BlockCheckpoint& checkpoint_;
  std::vector<std::vector<std::uint32_t>> position_;  ///< of the patches of each cell
  std::vector<std::vector<float>> couplings_;         ///< by cell, of the run that is solved for
  std::vector<PackedCouplings> packed_;               ///< by cell; empty until they are known
};

}  // namespace rebounce

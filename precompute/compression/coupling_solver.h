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
class CouplingSolver {
 public:
  /// Finds the cells that `checkpoint` holds. `solved`, `bases` and `checkpoint` must outlive the
  /// object. `cells_together` > 0 cells or a few more are solved for at the same time; the bits do
  /// not depend on it. Ranks take runs of so many cells in turns.
  CouplingSolver(const SolvedTransfer& solved, const SharedBases& bases, const FramedCells& cells,
                 std::size_t cells_together, const BlockCheckpoint& checkpoint);

  /// The vectors of all wanted cells, whoever solves for them.
  std::size_t vector_count() const;

  /// The vectors that this rank has to solve for.
  double work() const;

  /// Does the work and keeps the couplings of every cell in the checkpoint. Returns those of all
  /// cells, empty where they are not wanted. Call it once. Throws Cancelled if asked to stop.
  std::vector<PackedCouplings> run(const Progress& progress);

 private:
  /// Neighbouring vectors of the basis of a cell.
  struct Part {
    std::size_t cell;
    Eigen::Index begin, count;
  };

  /// Vectors that one thread solves for. Which ones follows from the ranks of the bases alone, as
  /// the bits of a product depend on its width.
  struct Pack {
    std::uint32_t matrix;
    std::vector<Part> parts;  ///< ascending
    Eigen::Index width = 0;
  };

  bool is_missing(std::size_t cell) const;
  bool is_missing(const Pack& pack) const;
  double work_of(std::size_t first) const;  ///< of the run that begins with this cell
  std::vector<Pack> packs_of(std::size_t first) const;
  std::vector<Pack> packs_between(std::size_t begin, std::size_t end, std::uint32_t matrix) const;
  void solve_run(std::size_t first, const Progress& progress);
  void solve(const Pack& pack, SolvedTransfer::Workspace& workspace);
  void keep(const Pack& pack, std::size_t d, const Eigen::MatrixXf& found);

  const SolvedTransfer& solved_;
  const SharedBases& bases_;
  std::vector<bool> is_wanted_;
  std::size_t together_;
  const BlockCheckpoint& checkpoint_;
  std::vector<std::vector<std::uint32_t>> position_;  ///< of the patches of each cell
  std::vector<std::vector<float>> couplings_;         ///< by cell, of the run that is solved for
  std::vector<PackedCouplings> packed_;               ///< by cell; empty until they are known
};

}  // namespace rebounce

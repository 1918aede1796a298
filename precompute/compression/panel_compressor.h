#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "precompute/compression/block_checkpoint.h"
#include "precompute/compression/matrix_compression.h"
#include "precompute/inverse/solved_matrix.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// The first stage of build_matrix_free_transfer: all of Yhat, compressed finely, some panels of
/// neighbouring columns at a time.
class PanelCompressor {
 public:
  /// Columns of a panel, and rows of the pieces that it is compressed in. Larger pieces save bytes
  /// that the second stage saves anyway, and at so fine a multiplier take several times as long.
  static constexpr std::uint32_t kPanelWidth = 512;

  /// Finds how blocks are cut and weighed, and what `checkpoint` has already. `matrix` and
  /// `checkpoint` must outlive the object. Of `panels_together` panels, > 0, the columns are there
  /// at the same time; the bits do not depend on it.
  PanelCompressor(PanelMatrix& matrix, const PatchTable& patches,
                  std::span<const std::vector<Float3>> training, double multiplier,
                  std::size_t panels_together, const BlockCheckpoint& checkpoint);
  PanelCompressor(const PanelCompressor&) = delete;
  PanelCompressor& operator=(const PanelCompressor&) = delete;

  /// What is left to do, in columns that are solved for.
  double work() const { return work_of(panels_); }

  /// Does it, and keeps every panel in the checkpoint; once. Throws Cancelled if asked to stop.
  HierarchicalStorage run(const Progress& progress);

 private:
  /// All pieces of a column of pieces.
  struct Panel {
    std::uint32_t column = 0;  ///< a cluster
    std::vector<BlockPiece> pieces;
    std::string name;
    std::optional<BlockPart> part;  ///< when it is done
  };

  void make_panels();
  double compression_work(const Panel& panel) const;
  double work_of(std::span<const Panel> panels) const;  ///< of those that are not done
  void run(std::span<Panel> panels, const Progress& progress);

  PanelMatrix& matrix_;
  double multiplier_;
  std::size_t panels_together_;
  const BlockCheckpoint& checkpoint_;
  CompressionFrame frame_;
  std::vector<ClusterWeight> weights_;
  BlockTreeCompressor compressor_;
  std::vector<Panel> panels_;   ///< by their first columns
  std::size_t all_pieces_ = 0;  ///< of panels, with those that nobody wants
};

}  // namespace rebounce

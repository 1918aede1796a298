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

/// The first stage of build_matrix_free_transfer: compresses all of Yhat finely, some panels of
/// neighbouring columns at a time.
class PanelCompressor {
 public:
  /// Columns of a panel, and rows of the pieces that it is compressed in. Larger pieces save bytes
  /// that the second stage saves anyway, and take several times as long at so small a multiplier
  /// (lab/060).
  static constexpr std::uint32_t kPanelWidth = 512;

  /// Prepares the cluster tree and the weights, and finds the panels that `checkpoint` holds.
  /// `matrix` and `checkpoint` must outlive the object. The columns of `panels_together` panels, >
  /// 0, are in memory at the same time; the bits do not depend on it. Ranks take runs of so many
  /// panels in turns.
  PanelCompressor(PanelMatrix& matrix, const PatchTable& patches,
                  std::span<const std::vector<Float3>> training, double multiplier,
                  std::size_t panels_together, const BlockCheckpoint& checkpoint);
  PanelCompressor(const PanelCompressor&) = delete;
  PanelCompressor& operator=(const PanelCompressor&) = delete;

  /// The remaining work of this rank, in columns that are solved for.
  double work() const;

  /// Does the work and keeps every panel in the checkpoint. Call it once. Throws Cancelled if asked
  /// to stop.
  HierarchicalStorage run(const Progress& progress);

 private:
  /// All pieces of a column of pieces.
  struct Panel {
    std::uint32_t column = 0;  ///< index of its cluster
    std::vector<BlockPiece> pieces;
    std::string name;
    std::optional<BlockPart> part;  ///< empty until the panel is done
  };

  void make_panels();
  void list_runs(std::size_t panels_together);
  double compression_work(const Panel& panel) const;
  double work_of(std::span<const Panel> panels) const;  ///< of the panels that are not done
  void run(std::span<Panel> panels, const Progress& progress);
  void share_runs();

  PanelMatrix& matrix_;
  double multiplier_;
  const BlockCheckpoint& checkpoint_;
  CompressionFrame frame_;
  std::vector<ClusterWeight> weights_;
  BlockTreeCompressor compressor_;
  std::vector<Panel> panels_;  ///< ordered by their first columns
  /// Neighbouring panels that are not done at the beginning, which are in memory at the same time.
  std::vector<std::span<Panel>> runs_;
  std::size_t all_pieces_ = 0;  ///< of all panels, including unwanted ones
};

}  // namespace rebounce

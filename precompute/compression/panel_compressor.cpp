#include "precompute/compression/panel_compressor.h"

#include <fmt/format.h>

#include <algorithm>

#include "precompute/base/progress.h"

namespace rebounce {
namespace {

// The time to compress all panels, in columns that are solved for (lab/059).
constexpr double kCompression = 5500;

}  // namespace

PanelCompressor::PanelCompressor(PanelMatrix& matrix, const PatchTable& patches,
                                 std::span<const std::vector<Float3>> training, double multiplier,
                                 std::size_t panels_together, const BlockCheckpoint& checkpoint)
    : matrix_(matrix),
      multiplier_(multiplier),
      checkpoint_(checkpoint),
      frame_(compression_frame(matrix, patches, training)),
      weights_(frame_.weights()),
      compressor_(matrix, frame_.tree, weights_) {
  multiplier_ = frame_.multiplier_for(multiplier);
  make_panels();
  for (Panel& panel : panels_) panel.part = checkpoint_.find(panel.name);
  list_runs(Ranks().least(panels_together));
}

void PanelCompressor::make_panels() {
  const std::vector<BlockPiece> pieces = block_pieces(frame_.tree, kPanelWidth);
  all_pieces_ = pieces.size();
  for (const BlockPiece& piece : pieces) {
    if (!compressor_.wants(piece)) continue;
    const auto found = std::ranges::find(panels_, piece.column, &Panel::column);
    Panel& panel =
        found == panels_.end() ? panels_.emplace_back(Panel{piece.column, {}, {}, {}}) : *found;
    panel.pieces.push_back(piece);
  }
  std::ranges::sort(panels_, {},
                    [&](const Panel& panel) { return frame_.tree.clusters[panel.column].begin; });
  for (std::size_t k = 0; k < panels_.size(); ++k) {
    panels_[k].name = fmt::format("panel_{:04}", k);
  }
}

void PanelCompressor::list_runs(std::size_t panels_together) {
  for (std::size_t first = 0; first < panels_.size(); ++first) {
    std::size_t end = first;
    while (end < panels_.size() && end - first < panels_together && !panels_[end].part) ++end;
    if (end == first) continue;
    runs_.push_back(std::span(panels_).subspan(first, end - first));
    first = end - 1;
  }
}

double PanelCompressor::work() const {
  const Ranks ranks;
  double work = 0;
  for (std::size_t k = 0; k < runs_.size(); ++k) {
    if (ranks.makes(k)) work += work_of(runs_[k]);
  }
  return work;
}

double PanelCompressor::compression_work(const Panel& panel) const {
  return kCompression * static_cast<double>(panel.pieces.size()) / static_cast<double>(all_pieces_);
}

double PanelCompressor::work_of(std::span<const Panel> panels) const {
  double work = 0;
  for (const Panel& panel : panels) {
    if (panel.part) continue;
    work += frame_.tree.clusters[panel.column].count + compression_work(panel);
  }
  return work;
}

HierarchicalStorage PanelCompressor::run(const Progress& progress) {
  const Ranks ranks;
  const double all = work();
  for (std::size_t k = 0; k < runs_.size(); ++k) {
    if (!ranks.makes(k)) continue;
    const double before = all - work();
    const CommunicatorScope alone(nullptr);
    run(runs_[k], part_of(progress, before / all, (before + work_of(runs_[k])) / all));
  }
  share_runs();
  BlockPart whole;
  for (Panel& panel : panels_) {
    whole.append(std::move(*panel.part));
    panel.part.reset();
  }
  return compressor_.assemble(std::move(whole));
}

/// Gives all ranks the panels that each has made: those of a run in its first panel.
void PanelCompressor::share_runs() {
  std::vector<BlockPart> parts(runs_.size());
  for (std::size_t k = 0; k < runs_.size(); ++k) {
    for (Panel& panel : runs_[k]) {
      if (panel.part) parts[k].append(std::move(*panel.part));
      panel.part.emplace();
    }
  }
  share(Ranks(), parts);
  for (std::size_t k = 0; k < runs_.size(); ++k) runs_[k].front().part = std::move(parts[k]);
}

void PanelCompressor::run(std::span<Panel> panels, const Progress& progress) {
  const double all = work_of(panels);
  std::vector<Cluster> columns;
  double done = 0;
  for (const Panel& panel : panels) {
    columns.push_back(frame_.tree.clusters[panel.column]);
    done += columns.back().count / all;
  }
  matrix_.solve(frame_.tree, columns, part_of(progress, 0, done));
  for (Panel& panel : panels) {
    const double end = done + compression_work(panel) / all;
    panel.part = compressor_.compress(panel.pieces, multiplier_, part_of(progress, done, end));
    checkpoint_.keep(panel.name, *panel.part);
    report_progress(progress, end);
    done = end;
  }
}

}  // namespace rebounce

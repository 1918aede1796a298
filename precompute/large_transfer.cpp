#include "rebounce/precompute/large_transfer.h"

#include <omp.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "block_tree.h"
#include "matrix_compression.h"
#include "panel_checkpoint.h"
#include "progress_part.h"
#include "rebounce/transfer/content_hash.h"
#include "rebounce/transfer/error.h"
#include "rebounce/transfer/version.h"
#include "solved_matrix.h"
#include "solved_transfer.h"

namespace rebounce {
namespace {

// Of the tolerance, the residual that columns are solved to. Measured: notes/operator.md.
constexpr double kResidualPart = 0.2;

// The price of a value in the first stage, in first prices of the search for the tolerance. Errors
// go about like the root of the price: a quarter of what the second stage may do.
constexpr double kFinePart = 1.0 / 16;

// The part of the whole time that the first stage takes, roughly.
constexpr double kFirstStage = 0.7;

// The part of the time of a panel that its columns take, roughly.
constexpr double kSolved = 0.8;

// Columns of a panel, and rows of the pieces that it is compressed in. Larger pieces save bytes
// that the second stage saves anyway, and at so fine a price take several times as long.
constexpr std::uint32_t kPanelWidth = 512;

// An operator of the first stage, the rounds of the second and what they are judged by, bytes a
// patch, far on the safe side.
constexpr std::size_t kOperatorBytes = 48 << 10;

/// Throws Error unless the limit, if there is one, has room for it all.
void check_memory(std::size_t patch_count, std::size_t matrix_count, std::uint64_t limit) {
  const std::size_t peak = large_transfer_peak_bytes(patch_count, matrix_count);
  if (limit == 0 || peak <= limit) return;
  throw Error("an operator over " + std::to_string(patch_count) + " patches needs " +
              std::to_string(peak >> 20) +
              " MiB; raise the memory limit, use fewer threads or ask for fewer patches");
}

template <typename T>
void update(ContentHash& hash, std::span<const T> values) {
  const std::uint64_t count = values.size();
  hash.update(std::as_bytes(std::span(&count, 1)));
  hash.update(std::as_bytes(values));
}

/// A hash of all that the first stage depends on.
std::string key_of(const HierarchicalOperator& form_factors, const PatchTable& patches,
                   const FittingLights& lights, const PatchRoles& roles, double price) {
  ContentHash hash;
  update(hash, std::span(std::string_view(version())));
  update<double>(hash, {{price, kResidualPart}});
  const HierarchicalOperator::Storage& f = form_factors.storage();
  update(hash, std::span(f.blocks));
  update(hash, f.values_f32.span());
  update(hash, f.values_f16.span());
  update(hash, f.bases_q16.span());
  update(hash, f.bases_q8.span());
  update<std::uint32_t>(hash, f.patch);
  update<float>(hash, patches.area);
  update<Float3>(hash, patches.centroid);
  update<Float3>(hash, patches.normal);
  update<Float3>(hash, patches.reflectance);
  update<std::uint8_t>(hash, roles.role);
  for (const std::vector<Float3>& light : lights.shaping) update<Float3>(hash, light);
  return hash.text();
}

/// All pieces of a column of pieces.
struct Panel {
  std::uint32_t column = 0;  ///< a cluster
  std::vector<BlockPiece> pieces;
};

/// What is wanted of the lower triangle as panels, the longest first.
std::vector<Panel> make_panels(const ClusterTree& tree, const BlockTreeCompressor& compressor) {
  std::vector<Panel> panels;
  for (const BlockPiece& piece : block_pieces(tree, kPanelWidth)) {
    if (!compressor.wants(piece)) continue;
    const auto found = std::ranges::find(panels, piece.column, &Panel::column);
    Panel& panel = found == panels.end() ? panels.emplace_back(Panel{piece.column, {}}) : *found;
    panel.pieces.push_back(piece);
  }
  std::ranges::sort(panels, {},
                    [&](const Panel& panel) { return tree.clusters[panel.column].begin; });
  return panels;
}

/// The first stage: all of Yhat, compressed finely, a panel at a time.
HierarchicalOperator::Storage compress_panels(PanelMatrix& matrix, const PatchTable& patches,
                                              std::span<const std::vector<Float3>> shaping,
                                              double price, const PanelCheckpoint& checkpoint,
                                              const Progress& progress) {
  const CompressionFrame frame = compression_frame(matrix, patches, shaping);
  const std::vector<ClusterWeight> weights = frame.weights();
  const BlockTreeCompressor compressor(matrix, frame.tree, weights);
  const std::vector<Panel> panels = make_panels(frame.tree, compressor);
  BlockPart whole;
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const auto count = static_cast<double>(panels.size());
    const Progress part =
        part_of(progress, static_cast<double>(k) / count, static_cast<double>(k + 1) / count);
    std::optional<BlockPart> panel = checkpoint.find(k);
    if (!panel) {
      matrix.solve(frame.tree, frame.tree.clusters[panels[k].column], part_of(part, 0, kSolved));
      panel = compressor.compress(panels[k].pieces, price, part_of(part, kSolved, 1));
      checkpoint.keep(k, *panel);
    }
    whole.append(std::move(*panel));
    report_progress(part, 1);
  }
  return compressor.assemble(std::move(whole));
}

}  // namespace

std::size_t large_transfer_peak_bytes(std::size_t patch_count, std::size_t matrix_count) {
  constexpr std::size_t kVectors = 8;  // those of the solver, coefficients, entries of F
  const std::size_t group = kVectors * patch_count * SolvedTransfer::kTogether * sizeof(float);
  const std::size_t side =
      largest_piece(static_cast<std::uint32_t>(HierarchicalOperator::position_count(patch_count)));
  const std::size_t piece = side * side * matrix_count * (sizeof(float) + 3 * sizeof(double));
  const auto threads = static_cast<std::size_t>(omp_get_max_threads());
  const std::size_t panel = patch_count * kPanelWidth * matrix_count * sizeof(float);
  return panel + threads * std::max(group, piece) + patch_count * kOperatorBytes;
}

std::shared_ptr<const HierarchicalOperator> build_large_transfer(
    const HierarchicalOperator& form_factors, const PatchTable& patches,
    const FittingLights& lights, const LargeTransferSettings& settings, const Progress& progress) {
  const double tolerance = settings.compression.tolerance;
  const SolvedTransfer solved(form_factors, patches, kResidualPart * tolerance);
  check_memory(patches.size(), solved.matrix_count(), settings.memory_limit_bytes);
  const double price = kFinePart * first_price(tolerance, patches.size());
  const PanelCheckpoint checkpoint(settings.checkpoint,
                                   key_of(form_factors, patches, lights, settings.roles, price));
  const Eigen::VectorXd energies = solved.estimated_energies(settings.roles);
  HierarchicalOperator::Storage fine;
  {
    PanelMatrix matrix(solved, energies, settings.roles);
    fine = compress_panels(matrix, patches, lights.shaping, price, checkpoint,
                           part_of(progress, 0, kFirstStage));
  }
  const RoundedMatrix rounded(solved, energies, fine);
  return compress_to_tolerance(rounded, patches, lights, settings.compression,
                               part_of(progress, kFirstStage, 1));
}

}  // namespace rebounce

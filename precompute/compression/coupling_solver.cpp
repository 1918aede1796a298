#include "precompute/compression/coupling_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "precompute/base/blas.h"
#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/base/ranks.h"
#include "precompute/compression/wanted_blocks.h"
#include "transfer/base/parallel.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

// Cells whose vectors are packed together: enough that few packs are not full.
constexpr std::size_t kPackedCells = 8;

std::string name_of(std::size_t cell) {
  return fmt::format("cell_{:04}", cell);
}

/// Of each cell, whether any entry on or below the diagonal is wanted in its columns.
std::vector<bool> wanted_columns(const FramedCells& framed) {
  const WantedBlocks blocks(framed.frame.roles, framed.frame.tree);
  const auto cells = framed.clusters;
  std::vector<bool> wanted(cells.size());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    for (std::size_t d = c; d < cells.size() && !wanted[c]; ++d) {
      wanted[c] = blocks.wanted(cells[d], cells[c]);
    }
  }
  return wanted;
}

}  // namespace

std::uint64_t coupling_count(const SharedBases& bases, const FramedCells& cells) {
  const std::vector<bool> wanted = wanted_columns(cells);
  std::uint64_t count = 0;
  for (std::size_t c = 0; c < wanted.size(); ++c) {
    if (wanted[c]) count += bases.coupling_count(c);
  }
  return count;
}

CouplingSolver::CouplingSolver(const SolvedTransfer& solved, const SharedBases& bases,
                               const FramedCells& cells, std::size_t cells_together,
                               const BlockCheckpoint& checkpoint)
    : solved_(solved),
      bases_(bases),
      is_wanted_(wanted_columns(cells)),
      together_(piece_count(Ranks().least(cells_together), kPackedCells) * kPackedCells),
      checkpoint_(checkpoint),
      couplings_(bases.cell_count()),
      packed_(bases.cell_count()) {
  const auto position = solved.form_factors().position();
  for (std::size_t cell = 0; cell < bases.cell_count(); ++cell) {
    std::vector<std::uint32_t>& own = position_.emplace_back();
    for (const std::uint32_t p : bases.patches[cell]) own.push_back(position[p]);
    if (!is_missing(cell)) continue;
    std::optional<BlockPart> found = checkpoint.find(name_of(cell));
    if (found && found->values.size() == bases.coupling_count(cell)) {
      packed_[cell] = pack_couplings(bases, cell, found->values);
    }
  }
}

bool CouplingSolver::is_missing(std::size_t cell) const {
  return is_wanted_[cell] && packed_[cell].empty() && bases_.coupling_count(cell) > 0;
}

bool CouplingSolver::is_missing(const Pack& pack) const {
  return std::ranges::any_of(pack.parts, [&](const Part& part) { return is_missing(part.cell); });
}

/// All vectors of one matrix of the wanted cells [begin, end).
std::vector<CouplingSolver::Pack> CouplingSolver::packs_between(std::size_t begin, std::size_t end,
                                                                std::uint32_t matrix) const {
  std::vector<Pack> packs;
  for (std::size_t cell = begin; cell < end; ++cell) {
    if (!is_wanted_[cell]) continue;
    const Index rank = bases_.rank(matrix, cell);
    for (Index first = 0; first < rank;) {
      if (packs.empty() || packs.back().width == SolvedTransfer::kBatchColumns) {
        packs.push_back({matrix, {}});
      }
      Pack& pack = packs.back();
      const Index count = std::min(rank - first, SolvedTransfer::kBatchColumns - pack.width);
      pack.parts.push_back({cell, first, count});
      pack.width += count;
      first += count;
    }
  }
  return packs;
}

/// The packs of the run that begins with cell `first` that hold a missing cell.
std::vector<CouplingSolver::Pack> CouplingSolver::packs_of(std::size_t first) const {
  std::vector<Pack> packs;
  const std::size_t last = std::min(bases_.cell_count(), first + together_);
  for (std::size_t begin = first; begin < last; begin += kPackedCells) {
    for (std::uint32_t m = 0; m < solved_.matrix_count(); ++m) {
      for (Pack& pack : packs_between(begin, std::min(last, begin + kPackedCells), m)) {
        if (is_missing(pack)) packs.push_back(std::move(pack));
      }
    }
  }
  return packs;
}

double CouplingSolver::work_of(std::size_t first) const {
  double work = 0;
  for (const Pack& pack : packs_of(first)) work += static_cast<double>(pack.width);
  return work;
}

std::size_t CouplingSolver::vector_count() const {
  Index count = 0;
  for (std::size_t cell = 0; cell < bases_.cell_count(); ++cell) {
    if (!is_wanted_[cell]) continue;
    for (std::uint32_t m = 0; m < solved_.matrix_count(); ++m) count += bases_.rank(m, cell);
  }
  return static_cast<std::size_t>(count);
}

double CouplingSolver::work() const {
  const Ranks ranks;
  double work = 0;
  for (std::size_t first = 0; first < bases_.cell_count(); first += together_) {
    if (ranks.makes(first, together_)) work += work_of(first);
  }
  return work;
}

std::vector<PackedCouplings> CouplingSolver::run(const Progress& progress) {
  load_blas();
  const Ranks ranks;
  const double all = work();
  double done = 0;
  for (std::size_t first = 0; first < bases_.cell_count(); first += together_) {
    if (!ranks.makes(first, together_)) continue;
    const double more = work_of(first);
    if (more == 0) continue;
    const CommunicatorScope alone(nullptr);
    solve_run(first, part_of(progress, done / all, (done + more) / all));
    done += more;
  }
  ranks.share(std::span(packed_), together_);
  return std::move(packed_);
}

void CouplingSolver::solve_run(std::size_t first, const Progress& progress) {
  const std::vector<Pack> packs = packs_of(first);
  std::vector<std::size_t> missing;
  for (std::size_t cell = first; cell < std::min(bases_.cell_count(), first + together_); ++cell) {
    if (is_missing(cell)) missing.push_back(cell);
  }
  for (const std::size_t cell : missing) couplings_[cell].resize(bases_.coupling_count(cell));
  ParallelProgress loop(progress, packs.size());
  using Workspace = SolvedTransfer::Workspace;
  parallel_loop(
      packs.size(), 1, [] { return Workspace(); },
      [&](std::size_t k, Workspace& workspace) {
        if (loop.stopped()) return;
        solve(packs[k], workspace);
        loop.advance();
      });
  loop.finish();
  for (const std::size_t cell : missing) {
    BlockPart part{.blocks = {}, .values = std::move(couplings_[cell])};
    checkpoint_.keep(name_of(cell), part);
    packed_[cell] = pack_couplings(bases_, cell, part.values);
  }
}

void CouplingSolver::solve(const Pack& pack, SolvedTransfer::Workspace& workspace) {
  const std::uint32_t matrix = pack.matrix;
  SolvedTransfer::Vectors sent =
      SolvedTransfer::Vectors::Zero(solved_.position_count(), pack.width);
  Index column = 0;
  for (const auto& [cell, begin, count] : pack.parts) {
    const MatrixXf& lights = bases_.bases[matrix][cell].lights;
    for (std::size_t k = 0; k < position_[cell].size(); ++k) {
      sent.row(position_[cell][k]).segment(column, count) =
          lights.row(static_cast<Index>(k)).segment(begin, count);
    }
    column += count;
  }
  const SolvedTransfer::Vectors& arrived = solved_.later_bounces(matrix, sent, workspace);
  for (std::size_t d = pack.parts.front().cell; d < bases_.cell_count(); ++d) {
    MatrixXf light(position_[d].size(), pack.width);
    for (std::size_t k = 0; k < position_[d].size(); ++k) {
      light.row(static_cast<Index>(k)) = arrived.row(position_[d][k]);
    }
    keep(pack, d, bases_.bases[matrix][d].lights.transpose() * light);
  }
}

/// Keeps the couplings of the vectors of a pack with those of cell `d`, where they are missing.
void CouplingSolver::keep(const Pack& pack, std::size_t d, const MatrixXf& found) {
  Index column = 0;
  for (const auto& [cell, begin, count] : pack.parts) {
    if (cell <= d && is_missing(cell)) {
      const Index rows = bases_.ranks_between(pack.matrix, cell, bases_.cell_count());
      float* const first = couplings_[cell].data() + bases_.coupling_begin(pack.matrix, cell);
      Eigen::Map<MatrixXf> couplings(first + begin * rows, rows, count);
      couplings.middleRows(bases_.ranks_between(pack.matrix, cell, d), found.rows()) =
          found.middleCols(column, count);
    }
    column += count;
  }
}

}  // namespace rebounce

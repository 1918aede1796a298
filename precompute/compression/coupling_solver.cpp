#include "precompute/compression/coupling_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
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

// Cells of each group whose vectors are packed together: enough that few packs are not full.
constexpr std::size_t kPackedCells = 8;

std::size_t group_count(const SharedBases& bases) {
  return bases.group.empty() ? 1 : 1 + std::ranges::max(bases.group);
}

std::string name_of(std::size_t cell) {
  return fmt::format("cell_{:04}", cell);
}

/// The cells: first the first of each group, then the second of each, and so on.
std::vector<std::size_t> order_by_groups(const SharedBases& bases) {
  std::vector<std::size_t> order(bases.cell_count()), place(bases.cell_count(), 0);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (bases.group.empty()) return order;
  std::vector<std::size_t> count(group_count(bases), 0);
  for (const std::size_t cell : order) place[cell] = count[bases.group[cell]]++;
  std::ranges::stable_sort(
      order, {}, [&](std::size_t cell) { return std::pair(place[cell], bases.group[cell]); });
  return order;
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
      order_(order_by_groups(bases)),
      packed_together_(kPackedCells * group_count(bases)),
      together_(piece_count(Ranks().least(cells_together), kPackedCells) * packed_together_),
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

class CouplingSolver::Packs {
 public:
  explicit Packs(std::uint32_t matrix) : matrix_(matrix) {}

  /// Adds vectors of a cell from a column on, counted from begin_next(). Returns that behind them.
  Index add(Index column, std::size_t cell, Index begin, Index end) {
    while (begin < end) {
      const std::size_t pack = first_ + static_cast<std::size_t>(column / kColumns);
      const Index in_pack = column % kColumns, count = std::min(end - begin, kColumns - in_pack);
      if (pack >= packs_.size()) packs_.resize(pack + 1, {matrix_, {}});
      packs_[pack].parts.push_back({cell, begin, count, in_pack});
      packs_[pack].width = std::max(packs_[pack].width, in_pack + count);
      begin += count;
      column += count;
    }
    return column;
  }

  /// What follows is in other packs.
  void begin_next() { first_ = packs_.size(); }

  std::vector<Pack> take() { return std::move(packs_); }

 private:
  static constexpr Index kColumns = SolvedTransfer::kBatchColumns;
  std::uint32_t matrix_;
  std::size_t first_ = 0;
  std::vector<Pack> packs_;
};

std::span<const std::size_t> CouplingSolver::cells_of_run(std::size_t first,
                                                          std::size_t count) const {
  return std::span(order_).subspan(first, std::min(count, order_.size() - first));
}

/// All vectors of one matrix of those of `cells` that are wanted.
std::vector<CouplingSolver::Pack> CouplingSolver::packs_of(std::span<const std::size_t> cells,
                                                           std::uint32_t matrix) const {
  Packs packs(matrix);
  Index far = 0;
  for (const std::size_t cell : cells) {
    if (is_wanted_[cell]) far = packs.add(far, cell, 0, bases_.bases[matrix][cell].far_rank);
  }
  packs.begin_next();
  std::vector<Index> near(group_count(bases_), 0);  // the next column of each group
  for (const std::size_t cell : cells) {
    if (!is_wanted_[cell]) continue;
    Index& column = near[bases_.group.empty() ? 0 : bases_.group[cell]];
    column =
        packs.add(column, cell, bases_.bases[matrix][cell].far_rank, bases_.rank(matrix, cell));
  }
  return packs.take();
}

/// The packs of the run that begins with `first`: `all`, or those that hold a missing cell.
std::vector<CouplingSolver::Pack> CouplingSolver::packs_of(std::size_t first, bool all) const {
  std::vector<Pack> packs;
  const std::size_t last = std::min(order_.size(), first + together_);
  for (std::size_t begin = first; begin < last; begin += packed_together_) {
    for (std::uint32_t m = 0; m < solved_.matrix_count(); ++m) {
      for (Pack& pack : packs_of(cells_of_run(begin, packed_together_), m)) {
        if (all || is_missing(pack)) packs.push_back(std::move(pack));
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

std::size_t CouplingSolver::solve_count() const {
  Index count = 0;
  for (std::size_t first = 0; first < order_.size(); first += together_) {
    for (const Pack& pack : packs_of(first, true)) count += pack.width;
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
  share_packed();
  return std::move(packed_);
}

void CouplingSolver::share_packed() {
  const Ranks ranks;
  if (ranks.alone()) return;
  std::vector<PackedCouplings> ordered(order_.size());
  for (std::size_t k = 0; k < order_.size(); ++k) ordered[k] = std::move(packed_[order_[k]]);
  ranks.share(std::span(ordered), together_);
  for (std::size_t k = 0; k < order_.size(); ++k) packed_[order_[k]] = std::move(ordered[k]);
}

void CouplingSolver::solve_run(std::size_t first, const Progress& progress) {
  const std::vector<Pack> packs = packs_of(first);
  std::vector<std::size_t> missing;
  for (const std::size_t cell : cells_of_run(first, together_)) {
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
  std::size_t lowest = bases_.cell_count();
  std::vector<std::size_t> offset;  // of the next block of each part, in the couplings of its cell
  for (const auto& [cell, begin, count, column] : pack.parts) {
    const MatrixXf& lights = bases_.bases[matrix][cell].lights;
    for (std::size_t k = 0; k < position_[cell].size(); ++k) {
      sent.row(position_[cell][k]).segment(column, count) =
          lights.row(static_cast<Index>(k)).segment(begin, count);
    }
    lowest = std::min(lowest, cell);
    offset.push_back(bases_.coupling_begin(matrix, cell));
  }
  const SolvedTransfer::Vectors& arrived = solved_.later_bounces(matrix, sent, workspace);
  for (std::size_t d = lowest; d < bases_.cell_count(); ++d) {
    MatrixXf light(position_[d].size(), pack.width);
    for (std::size_t k = 0; k < position_[d].size(); ++k) {
      light.row(static_cast<Index>(k)) = arrived.row(position_[d][k]);
    }
    const MatrixXf found = bases_.bases[matrix][d].lights.transpose() * light;
    for (std::size_t p = 0; p < pack.parts.size(); ++p) {
      if (pack.parts[p].cell > d) continue;
      keep(pack.matrix, pack.parts[p], d, found, offset[p]);
      offset[p] += bases_.coupling_size(matrix, d, pack.parts[p].cell);
    }
  }
}

/// Keeps the couplings of the vectors of a part with those of cell `d`, whose couplings with the
/// cell of the part begin at `offset`, where they are missing.
void CouplingSolver::keep(std::uint32_t matrix, const Part& part, std::size_t d,
                          const MatrixXf& found, std::size_t offset) {
  const Index rows = bases_.coupled_rank(matrix, d, part.cell),
              columns = bases_.coupled_rank(matrix, part.cell, d);
  if (part.begin >= columns || couplings_[part.cell].empty()) return;
  Eigen::Map<MatrixXf> coupling(couplings_[part.cell].data() + offset, rows, columns);
  coupling.middleCols(part.begin, part.count) = found.block(0, part.column, rows, part.count);
}

}  // namespace rebounce

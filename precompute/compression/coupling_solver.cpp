#include "precompute/compression/coupling_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "precompute/base/blas.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/base/ranks.h"
#include "precompute/compression/wanted_blocks.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

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

CouplingSolver::CouplingSolver(const SolvedTransfer& solved, const SharedBases& bases,
                               const FramedCells& cells, std::size_t cells_together,
                               const BlockCheckpoint& checkpoint)
    : solved_(solved),
      bases_(bases),
      is_wanted_(wanted_columns(cells)),
      together_(Ranks().least(cells_together)),
      checkpoint_(checkpoint),
      couplings_(bases.cell_count()) {
  const auto position = solved.form_factors().position();
  for (std::size_t cell = 0; cell < bases.cell_count(); ++cell) {
    std::vector<std::uint32_t>& own = position_.emplace_back();
    for (const std::uint32_t p : bases.patches[cell]) own.push_back(position[p]);
    if (!is_missing(cell)) continue;
    std::optional<BlockPart> found = checkpoint.find(name_of(cell));
    if (found && found->values.size() == bases.coupling_count(cell)) {
      couplings_[cell] = std::move(found->values);
    }
  }
}

bool CouplingSolver::is_missing(std::size_t cell) const {
  return is_wanted_[cell] && couplings_[cell].size() < bases_.coupling_count(cell);
}

std::vector<CouplingSolver::Group> CouplingSolver::groups_of(std::size_t first) const {
  std::vector<Group> groups;
  for (std::size_t cell = first; cell < std::min(bases_.cell_count(), first + together_); ++cell) {
    if (!is_missing(cell)) continue;
    for (std::uint32_t m = 0; m < solved_.matrix_count(); ++m) {
      const Index rank = bases_.rank(m, cell);
      for (Index begin = 0; begin < rank; begin += SolvedTransfer::kBatchColumns) {
        groups.push_back({cell, m, begin, std::min(SolvedTransfer::kBatchColumns, rank - begin)});
      }
    }
  }
  return groups;
}

double CouplingSolver::work_of(std::size_t first) const {
  double work = 0;
  for (const Group& group : groups_of(first)) work += static_cast<double>(group.count);
  return work;
}

double CouplingSolver::work() const {
  const Ranks ranks;
  double work = 0;
  for (std::size_t first = 0; first < bases_.cell_count(); first += together_) {
    if (ranks.makes(first, together_)) work += work_of(first);
  }
  return work;
}

std::vector<std::vector<float>> CouplingSolver::run(const Progress& progress) {
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
  ranks.share(std::span(couplings_), together_);
  return std::move(couplings_);
}

void CouplingSolver::solve_run(std::size_t first, const Progress& progress) {
  const std::vector<Group> groups = groups_of(first);
  for (const Group& group : groups) {
    couplings_[group.cell].resize(bases_.coupling_count(group.cell));
  }
  std::exception_ptr failure;
  ParallelProgress loop(progress, groups.size());
#pragma omp parallel
  {
    SolvedTransfer::Workspace workspace;
#pragma omp for schedule(dynamic, 1)
    for (std::size_t k = 0; k < groups.size(); ++k) {
      if (loop.stopped()) continue;
      try {
        solve(groups[k], workspace);
      } catch (...) {
#pragma omp critical
        failure = std::current_exception();
      }
      loop.advance();
    }
  }
  if (failure) std::rethrow_exception(failure);
  loop.finish();
  std::size_t before = bases_.cell_count();
  for (const Group& group : groups) {
    if (group.cell == before) continue;
    before = group.cell;
    checkpoint_.keep(name_of(before), {.blocks = {}, .values = couplings_[before]});
  }
}

void CouplingSolver::solve(const Group& group, SolvedTransfer::Workspace& workspace) {
  const auto [cell, matrix, begin, count] = group;
  SolvedTransfer::Vectors sent = SolvedTransfer::Vectors::Zero(solved_.position_count(), count);
  const MatrixXf& lights = bases_.bases[matrix][cell].lights;
  for (std::size_t k = 0; k < position_[cell].size(); ++k) {
    sent.row(position_[cell][k]) = lights.row(static_cast<Index>(k)).segment(begin, count);
  }
  const SolvedTransfer::Vectors& arrived = solved_.later_bounces(matrix, sent, workspace);
  float* const first = couplings_[cell].data() + bases_.coupling_begin(matrix, cell);
  const Index rows = bases_.ranks_between(matrix, cell, bases_.cell_count());
  Eigen::Map<MatrixXf> couplings(first + begin * rows, rows, count);
  Index row = 0;
  for (std::size_t d = cell; d < bases_.cell_count(); ++d) {
    MatrixXf light(position_[d].size(), count);
    for (std::size_t k = 0; k < position_[d].size(); ++k) {
      light.row(static_cast<Index>(k)) = arrived.row(position_[d][k]);
    }
    const Index rank = bases_.rank(matrix, d);
    couplings.middleRows(row, rank).noalias() = bases_.bases[matrix][d].lights.transpose() * light;
    row += rank;
  }
}

}  // namespace rebounce

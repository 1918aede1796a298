#include "precompute/inverse/solved_matrix.h"

#include <algorithm>
#include <exception>

#include "precompute/base/blas.h"
#include "precompute/base/parallel_progress.h"

namespace rebounce {
namespace {

using Eigen::Index;

constexpr auto kBatchColumns = static_cast<std::size_t>(SolvedTransfer::kBatchColumns);

/// Columns that one thread solves for. The first is counted over all panels.
struct Group {
  std::uint32_t matrix;
  std::size_t begin, count;
};

/// The columns of `panels` that hold patches, in groups. There are `patch_count` patches.
std::vector<Group> make_groups(std::span<const Cluster> panels, std::size_t patch_count,
                               std::uint32_t matrix_count) {
  std::vector<Group> groups;
  const std::size_t first = panels.front().begin;
  for (std::uint32_t m = 0; m < matrix_count; ++m) {
    for (const Cluster& panel : panels) {
      const std::size_t end = std::min<std::size_t>(panel.begin + panel.count, patch_count);
      for (std::size_t begin = panel.begin; begin < end; begin += kBatchColumns) {
        groups.push_back({m, begin - first, std::min(kBatchColumns, end - begin)});
      }
    }
  }
  return groups;
}

/// Keeps the memory of the first panel: later panels have fewer rows, and the operating system
/// clears new pages when they are written to.
void make_room(SolvedTransfer::Vectors& part, std::size_t rows, std::size_t columns) {
  const Index rows_had = part.rows(), columns_had = part.cols();
  if (rows_had >= static_cast<Index>(rows) && columns_had >= static_cast<Index>(columns)) return;
  part.resize(std::max(rows_had, static_cast<Index>(rows)),
              std::max(columns_had, static_cast<Index>(columns)));
}

}  // namespace

void PanelMatrix::solve(const ClusterTree& tree, std::span<const Cluster> panels,
                        const Progress& progress) {
  const std::vector<Group> groups = make_groups(panels, tree.patch.size(), matrix_count());
  const auto rows = std::span(tree.patch).subspan(panels.front().begin);
  const std::size_t width = groups.back().begin + groups.back().count;
  panel_.resize(matrix_count());
  for (auto& part : panel_) make_room(part, rows.size(), width);
  place_.assign(tree.patch.size(), kNone);
  for (std::uint32_t k = 0; k < rows.size(); ++k) place_[rows[k]] = k;

  load_blas();
  std::exception_ptr failure;
  ParallelProgress loop(progress, groups.size());
#pragma omp parallel
  {
    SolvedTransfer::Workspace workspace;
#pragma omp for schedule(dynamic, 1)
    for (std::size_t k = 0; k < groups.size(); ++k) {
      if (loop.stopped()) continue;
      const auto [matrix, begin, count] = groups[k];
      try {
        keep(solved().columns(matrix, rows.subspan(begin, count), workspace), matrix, begin);
      } catch (...) {
#pragma omp critical
        failure = std::current_exception();
      }
      loop.advance();
    }
  }
  if (failure) std::rethrow_exception(failure);
  loop.finish();
}

void PanelMatrix::keep(const SolvedTransfer::Vectors& columns, std::uint32_t matrix,
                       std::size_t begin) {
  for (std::size_t i = 0; i < place_.size(); ++i) {
    const std::uint32_t row = place_[solved().patch()[i]];
    if (row == kNone) continue;
    panel_[matrix].row(row).segment(static_cast<Index>(begin), columns.cols()) =
        columns.row(static_cast<Index>(i));
  }
}

void PanelMatrix::entries(std::uint32_t matrix, std::span<const std::uint32_t> rows,
                          std::span<const std::uint32_t> columns,
                          Eigen::Ref<Eigen::MatrixXf> entries) const {
  const SolvedTransfer::Vectors& panel = panel_[matrix];
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = panel.row(place_[rows[i]]);
    for (std::size_t j = 0; j < columns.size(); ++j) {
      entries(static_cast<Index>(i), static_cast<Index>(j)) = row[place_[columns[j]]];
    }
  }
}

}  // namespace rebounce

#include "solved_matrix.h"

#include <algorithm>
#include <exception>

#include "rebounce/precompute/parallel_progress.h"
#include "single_threaded_blas.h"

namespace rebounce {
namespace {

using Eigen::Index;

constexpr auto kTogether = static_cast<std::size_t>(SolvedTransfer::kTogether);

}  // namespace

void PanelMatrix::solve(const ClusterTree& tree, const Cluster& columns, const Progress& progress) {
  const auto rows = std::span(tree.patch).subspan(columns.begin);
  const std::size_t width = std::min<std::size_t>(columns.count, rows.size());
  panel_.resize(matrix_count());
  for (auto& part : panel_) part.resize(static_cast<Index>(rows.size()), static_cast<Index>(width));
  place_.assign(tree.patch.size(), kNone);
  for (std::uint32_t k = 0; k < rows.size(); ++k) place_[rows[k]] = k;

  const std::size_t group_count = (width + kTogether - 1) / kTogether;
  const SingleThreadedBlas single_threaded;
  std::exception_ptr failure;
  ParallelProgress loop(progress, group_count * matrix_count());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < group_count * matrix_count(); ++k) {
    if (loop.stopped()) continue;
    const auto matrix = static_cast<std::uint32_t>(k / group_count);
    const std::size_t begin = k % group_count * kTogether;
    const auto group = rows.subspan(begin, std::min(kTogether, width - begin));
    try {
      const SolvedTransfer::Vectors solution = solved().columns(matrix, group);
      for (std::size_t i = 0; i < place_.size(); ++i) {
        const std::uint32_t row = place_[solved().patch()[i]];
        if (row == kNone) continue;
        panel_[matrix].row(row).segment(static_cast<Index>(begin), solution.cols()) =
            solution.row(static_cast<Index>(i));
      }
    } catch (...) {
#pragma omp critical
      failure = std::current_exception();
    }
    loop.advance();
  }
  if (failure) std::rethrow_exception(failure);
  loop.finish();
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

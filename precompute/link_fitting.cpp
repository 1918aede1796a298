#include "rebounce/precompute/link_fitting.h"

#include <algorithm>
#include <vector>

#include "affine_links.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using Eigen::Vector3d;

/// The exchange areas by positions in the order of a tree, rows at the lower position.
class SortedPairs {
 public:
  struct Pair {
    std::uint32_t column;
    float exchange;
  };

  SortedPairs(const ExchangeMatrix& exchange, std::span<const std::uint32_t> patch)
      : begin_(patch.size() + 1, 0), pairs_(exchange.column.size()) {
    std::vector<std::uint32_t> position(patch.size());
    for (std::uint32_t k = 0; k < position.size(); ++k) position[patch[k]] = k;
    const auto for_each_pair = [&](const auto& visit) {
      for (std::uint32_t i = 0; i < position.size(); ++i) {
        for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
          const std::uint32_t p = position[i], q = position[exchange.column[k]];
          visit(std::min(p, q), Pair{std::max(p, q), exchange.exchange_area[k]});
        }
      }
    };
    for_each_pair([&](std::uint32_t row, const Pair&) { ++begin_[row + 1]; });
    for (std::size_t k = 1; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
    std::vector<std::uint64_t> next(begin_.begin(), begin_.end() - 1);
    for_each_pair([&](std::uint32_t row, const Pair& pair) { pairs_[next[row]++] = pair; });
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t row = 0; row < position.size(); ++row) {
      std::ranges::sort(pairs_.begin() + static_cast<std::ptrdiff_t>(begin_[row]),
                        pairs_.begin() + static_cast<std::ptrdiff_t>(begin_[row + 1]), {},
                        &Pair::column);
    }
  }

  /// Those of a row whose columns are in [first, end).
  std::span<const Pair> of_row(std::uint32_t row, std::uint32_t first, std::uint32_t end) const {
    const auto all = std::span(pairs_).subspan(begin_[row], begin_[row + 1] - begin_[row]);
    const auto from = std::ranges::lower_bound(all, first, {}, &Pair::column);
    const auto to = std::ranges::lower_bound(from, all.end(), end, {}, &Pair::column);
    return {from, to};
  }

 private:
  std::vector<std::uint64_t> begin_;  ///< [n + 1]
  std::vector<Pair> pairs_;
};

/// A range of positions.
struct Range {
  std::uint32_t begin, end;
};

class LinkFitting {
 public:
  LinkFitting(const FormFactorLinks& links, const ExchangeMatrix& exchange,
              const PatchTable& patches)
      : links_(links),
        patches_(patches),
        nodes_(spread_nodes(links, patches.area, patches.centroid)),
        first_(first_positions(links)),
        pairs_(exchange, links.patch) {}

  /// Link `l` with what its pairs say: sums of the kernel, and of the kernel with the place in
  /// either node. Of a single patch with itself there is no gradient.
  AffineLink fit(std::size_t l) const {
    auto [a, b] = links_.pair[l];
    if (first_[a] > first_[b]) std::swap(a, b);
    AffineLink link{.a = a, .b = b};
    Vector3d moment_a = Vector3d::Zero(), moment_b = Vector3d::Zero();
    const Range rows = range_of(a), columns = range_of(b);
    for (std::uint32_t row = rows.begin; row < rows.end; ++row) {
      double sum = 0;
      for (const auto& [column, exchange] : pairs_.of_row(row, columns.begin, columns.end)) {
        sum += exchange;
        moment_b += exchange * from_center(column, b);
      }
      moment_a += sum * from_center(row, a);
      link.exchange += sum;
    }
    link.gradient_a = nodes_[a].inverse * moment_a;
    link.gradient_b = nodes_[b].inverse * moment_b;
    return link;
  }

 private:
  Range range_of(std::uint32_t node) const {
    return {first_[node], first_[node] + links_.count[node]};
  }

  Vector3d from_center(std::uint32_t position, std::uint32_t node) const {
    const Float3& p = patches_.centroid[links_.patch[position]];
    return Vector3d(p[0], p[1], p[2]) - nodes_[node].center;
  }

  const FormFactorLinks& links_;
  const PatchTable& patches_;
  const std::vector<NodeSpread> nodes_;
  const std::vector<std::uint32_t> first_;  ///< position of the first patch of a node
  const SortedPairs pairs_;
};

std::vector<float> row_sums_of_pairs(const ExchangeMatrix& exchange,
                                     const std::vector<float>& area) {
  std::vector<double> sum(area.size());
  for (std::uint32_t i = 0; i < area.size(); ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t j = exchange.column[k];
      const double value = exchange.exchange_area[k];
      sum[i] += value / area[i];
      if (j != i) sum[j] += value / area[j];
    }
  }
  return {sum.begin(), sum.end()};
}

}  // namespace

FormFactorLinks fit_links(const FormFactorLinks& links, const ExchangeMatrix& exchange,
                          const PatchTable& patches) {
  check_links(links, patches.size());
  if (exchange.patch_count() != patches.size()) {
    throw Error("links: form factors and patches differ in number");
  }
  const LinkFitting fitting(links, exchange, patches);
  std::vector<AffineLink> fitted(links.pair.size());
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t l = 0; l < fitted.size(); ++l) fitted[l] = fitting.fit(l);
  FormFactorLinks result;
  result.patch = links.patch;
  result.first_child = links.first_child;
  result.count = links.count;
  result.scale.assign(patches.size(), 1);
  for (const AffineLink& link : fitted) {
    if (link.exchange > 0) append_link(link, result);
  }
  scale_rows(row_sums_of_pairs(exchange, patches.area), patches.area, patches.centroid, result);
  return result;
}

}  // namespace rebounce

#include "precompute/exchange/links/pair_sums.h"

#include <algorithm>
#include <cmath>

namespace rebounce {

using Eigen::Vector3d;

SortedPairs::SortedPairs(const ExchangeMatrix& exchange, std::span<const std::uint32_t> patch)
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

std::span<const SortedPairs::Pair> SortedPairs::of_row(std::uint32_t row,
                                                       PositionRange columns) const {
  const auto all = std::span(pairs_).subspan(begin_[row], begin_[row + 1] - begin_[row]);
  const auto from = std::ranges::lower_bound(all, columns.begin, {}, &Pair::column);
  const auto to = std::ranges::lower_bound(from, all.end(), columns.end(), {}, &Pair::column);
  return {from, to};
}

void SortedPairs::block(PositionRange rows, PositionRange columns,
                        std::span<float> exchange) const {
  std::ranges::fill(exchange, 0.0F);
  for (std::uint32_t r = 0; r < rows.count; ++r) {
    const auto row = exchange.subspan(std::size_t{r} * columns.count, columns.count);
    for (const Pair& pair : of_row(rows.begin + r, columns)) {
      row[pair.column - columns.begin] = pair.exchange;
    }
  }
}

void LinkedPairs::block(PositionRange rows, PositionRange columns,
                        std::span<float> exchange) const {
  const auto of_rows = patch_.subspan(rows.begin, rows.count);
  const auto of_columns = patch_.subspan(columns.begin, columns.count);
  // Eigen matrices are column-major: this is the transposed block.
  Eigen::Map<Eigen::MatrixXf> entries(exchange.data(), columns.count, rows.count);
  matrix_.entries(0, of_columns, of_rows, entries);
  for (std::uint32_t r = 0; r < rows.count; ++r) {
    for (std::uint32_t c = 0; c < columns.count; ++c) {
      const float root = std::sqrt(patches_.area[of_rows[r]] * patches_.area[of_columns[c]]);
      // An affine kernel may fall below 0 at the end of a node.
      entries(c, r) = std::max(0.0F, entries(c, r) * root);
    }
  }
}

PairSums& PairSums::operator+=(const PairSums& other) {
  count += other.count;
  squared += other.squared;
  exchange += other.exchange;
  of_rows += other.of_rows;
  of_columns += other.of_columns;
  return *this;
}

PairSums& PairSums::operator-=(const PairSums& other) {
  count -= other.count;
  squared -= other.squared;
  exchange -= other.exchange;
  of_rows -= other.of_rows;
  of_columns -= other.of_columns;
  return *this;
}

PairSums SummedPairTable::sums_of(std::uint32_t row, std::uint32_t column, float exchange) const {
  const std::uint32_t i = patch_[row], j = patch_[column];
  const Float3 &x = patches_.centroid[i], &y = patches_.centroid[j];
  const double s = exchange;
  PairSums sums;
  sums.count = 1;
  sums.squared = s * s / (static_cast<double>(patches_.area[i]) * patches_.area[j]);
  sums.exchange = s;
  sums.of_rows = s * Vector3d(x[0], x[1], x[2]);
  sums.of_columns = s * Vector3d(y[0], y[1], y[2]);
  return sums;
}

bool SummedPairTable::add_up(PositionRange rows, PositionRange columns) {
  rows_ = rows;
  columns_ = columns;
  exchange_.resize(std::size_t{rows.count} * columns.count);
  pairs_.block(rows, columns, exchange_);
  if (std::ranges::all_of(exchange_, [](float e) { return e == 0; })) return false;
  const std::size_t width = std::size_t{columns.count} + 1;
  table_.resize((std::size_t{rows.count} + 1) * width);
  std::fill_n(table_.begin(), width, PairSums{});
  const float* exchange = exchange_.data();
  for (std::uint32_t r = 0; r < rows.count; ++r) {
    PairSums row;
    at(r + 1, 0) = row;
    for (std::uint32_t c = 0; c < columns.count; ++c, ++exchange) {
      if (*exchange != 0) row += sums_of(rows.begin + r, columns.begin + c, *exchange);
      (at(r + 1, c + 1) = row) += at(r, c + 1);
    }
  }
  return true;
}

PairSums SummedPairTable::of(PositionRange rows, PositionRange columns) const {
  const std::uint32_t top = rows.begin - rows_.begin, left = columns.begin - columns_.begin;
  const std::uint32_t bottom = top + rows.count, right = left + columns.count;
  PairSums sums = at(bottom, right);
  sums -= at(top, right);
  sums -= at(bottom, left);
  sums += at(top, left);
  return sums;
}

}  // namespace rebounce

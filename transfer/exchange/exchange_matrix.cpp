#include "transfer/exchange/exchange_matrix.h"

#include <algorithm>

#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr std::size_t kMatrixRowsPerTask = 64;

}  // namespace

FormFactorRows::FormFactorRows(const ExchangeMatrix& exchange, std::span<const float> area) {
  const std::size_t n = exchange.patch_count();
  if (exchange.empty()) {
    throw Error(
        "form factors: there are no pairs, compressed ones only; make them again with "
        "--form-factors pairs");
  }
  if (area.size() != n) throw Error("form factors and patch areas differ in number");
  row_begin_.assign(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    row_begin_[i + 1] += exchange.row_begin[i + 1] - exchange.row_begin[i];
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      if (exchange.column[k] != i) ++row_begin_[exchange.column[k] + 1];
    }
  }
  for (std::size_t i = 0; i < n; ++i) row_begin_[i + 1] += row_begin_[i];

  column_.resize(row_begin_[n]);
  form_factor_.resize(row_begin_[n]);
  std::vector<std::uint64_t> next(row_begin_.begin(), row_begin_.end() - 1);
  const auto append = [&](std::size_t i, std::size_t j, float exchange_area) {
    const std::uint64_t k = next[i]++;
    column_[k] = static_cast<std::uint32_t>(j);
    form_factor_[k] = exchange_area / area[i];
  };
  // Row i of the upper triangle comes after all (j, i) with j < i, so columns ascend.
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      append(i, exchange.column[k], exchange.exchange_area[k]);
      if (exchange.column[k] != i) append(exchange.column[k], i, exchange.exchange_area[k]);
    }
  }
}

std::size_t FormFactorRows::bytes() const {
  return row_begin_.size() * sizeof(row_begin_[0]) + column_.size() * sizeof(column_[0]) +
         form_factor_.size() * sizeof(form_factor_[0]);
}

void FormFactorRows::do_gather(std::span<const Float3> in, std::span<Float3> out,
                               std::span<float> /*workspace*/, const Scheduler& scheduler) const {
  const auto gather_row = [&](std::size_t row) {
    double red = 0, green = 0, blue = 0;
    for (std::uint64_t k = row_begin_[row]; k < row_begin_[row + 1]; ++k) {
      const Float3& value = in[column_[k]];
      const double f = form_factor_[k];
      red += f * value[0];
      green += f * value[1];
      blue += f * value[2];
    }
    out[row] = {static_cast<float>(red), static_cast<float>(green), static_cast<float>(blue)};
  };
  parallel_for_pieces(scheduler, patch_count(), kMatrixRowsPerTask, gather_row);
}

}  // namespace rebounce

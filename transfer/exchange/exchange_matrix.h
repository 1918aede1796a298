#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rebounce/types.h"
#include "transfer/base/shared_array.h"
#include "transfer/exchange/form_factor_operator.h"

namespace rebounce {

/// The form factors as exchange areas S(i,j) = area(i) F(i,j) in m².
///
/// S is symmetric (reciprocity), so only the upper triangle is stored, by rows. One value gives
/// F(i,j) = S/area(i) and F(j,i) = S/area(j), so reciprocity is exact. Pairs that do not see each
/// other are absent, and so are the diagonal entries of flat patches, which do not see themselves.
struct ExchangeMatrix {
  SharedArray<std::uint64_t> row_begin;  ///< [n + 1], row_begin[n] = number of entries
  SharedArray<std::uint32_t> column;     ///< ascending in each row, row <= column < n
  SharedArray<float> exchange_area;      ///< m², > 0

  bool empty() const { return row_begin.empty(); }  ///< no pairs are stored
  std::size_t patch_count() const { return empty() ? 0 : row_begin.size() - 1; }
};

/// Form factors by full rows, for gathering: row i lists every j with F(i,j) > 0. Has twice the
/// entries of the ExchangeMatrix it is made from.
class FormFactorRows final : public FormFactorOperator {
 public:
  /// Expands `exchange`. `area` has n entries in m². Throws Error if the sizes do not agree or
  /// `exchange` is empty.
  FormFactorRows(const ExchangeMatrix& exchange, std::span<const float> area);

  std::size_t patch_count() const override { return row_begin_.size() - 1; }
  std::span<const std::uint32_t> columns(std::size_t row) const {
    return {column_.data() + row_begin_[row], column_.data() + row_begin_[row + 1]};
  }
  std::span<const float> form_factors(std::size_t row) const {
    return {form_factor_.data() + row_begin_[row], form_factor_.data() + row_begin_[row + 1]};
  }
  std::size_t bytes() const override;
  std::size_t workspace_size() const override { return 0; }

  using FormFactorOperator::gather;
  void gather(std::span<const Float3> in, std::span<Float3> out) const { gather(in, out, {}); }

 private:
  /// Rows are summed in double precision and shared out among threads; no workspace is used.
  void do_gather(std::span<const Float3> in, std::span<Float3> out, std::span<float> workspace,
                 const Scheduler& scheduler) const override;

  std::vector<std::uint64_t> row_begin_;
  std::vector<std::uint32_t> column_;
  std::vector<float> form_factor_;
};

}  // namespace rebounce

#pragma once

// Form factors that are made by hand in hierarchical form, for tests that need no scene.

#include <cmath>
#include <memory>
#include <numeric>
#include <span>
#include <vector>

#include "transfer/exchange/compressed_form_factors.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce::test {

/// G = A^1/2 F A^-1/2 in dense blocks of 32 positions, exact to rounding: the patches from the last
/// to the first.
inline std::shared_ptr<const HierarchicalOperator> dense_blocks(const ExchangeMatrix& exchange,
                                                                std::span<const float> area) {
  constexpr std::uint32_t kLeaf = 32;
  const std::size_t n = area.size();
  const auto positions = static_cast<std::uint32_t>(HierarchicalFormat::position_count(n));
  std::vector<float> full(std::size_t{positions} * positions, 0.0F);
  const FormFactorRows rows(exchange, area);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < rows.columns(i).size(); ++k) {
      const std::size_t j = rows.columns(i)[k];
      full[(n - 1 - i) * positions + (n - 1 - j)] =
          rows.form_factors(i)[k] * std::sqrt(area[i] / area[j]);
    }
  }
  HierarchicalStorage storage;
  storage.area.assign(area.begin(), area.end());
  storage.patch.resize(n);
  for (std::size_t i = 0; i < n; ++i) storage.patch[i] = static_cast<std::uint32_t>(n - 1 - i);
  storage.matrix_count = 1;
  std::vector<float> values;
  for (std::uint32_t r = 0; r < positions; r += kLeaf) {
    for (std::uint32_t c = 0; c <= r; c += kLeaf) {
      const TransferBlock block{.row_begin = r,
                                .row_count = std::min(kLeaf, positions - r),
                                .column_begin = c,
                                .column_count = std::min(kLeaf, positions - c)};
      storage.blocks.push_back(block);
      for (std::uint32_t i = 0; i < block.row_count; ++i) {
        const float* row = full.data() + std::size_t{r + i} * positions + c;
        values.insert(values.end(), row, row + block.column_count);
      }
    }
  }
  values.resize(values.size() + HierarchicalFormat::kPadding, 0.0F);
  storage.values_f32 = SharedArray(std::move(values));
  return std::make_shared<const HierarchicalOperator>(std::move(storage));
}

}  // namespace rebounce::test

#include "precompute/base/entry_parts.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Indices = std::vector<std::uint32_t>;

bool are_neighbours(const Indices& indices) {
  for (std::size_t k = 1; k < indices.size(); ++k) {
    if (indices[k] != indices[0] + k) return false;
  }
  return true;
}

/// Calls `use` with the rows of `vectors` at some indices.
template <typename Use>
void with_rows(const RowVectors& vectors, const Indices& indices, const Use& use) {
  const auto count = static_cast<Index>(indices.size());
  if (are_neighbours(indices)) {
    use(vectors.middleRows(indices.front(), count));
    return;
  }
  RowVectors some(count, vectors.cols());
  for (Index k = 0; k < count; ++k) some.row(k) = vectors.row(indices[k]);
  use(some.middleRows(0, count));
}

/// Adds `product` to the rows of `vectors` at some indices.
template <typename Product>
void add_to_rows(const Product& product, const Indices& indices, RowVectors& vectors) {
  const auto count = static_cast<Index>(indices.size());
  if (are_neighbours(indices)) {
    vectors.middleRows(indices.front(), count).noalias() += product;
    return;
  }
  const RowVectors& some = product;
  for (Index k = 0; k < count; ++k) vectors.row(indices[k]) += some.row(k);
}

}  // namespace

void add_product(const EntryParts& parts, const RowVectors& x, RowVectors& y) {
  for (const EntryPart& part : parts) {
    with_rows(x, part.columns, [&](const auto& at_columns) {
      if (part.is_product()) {
        const RowVectors within = part.right.transpose() * at_columns;
        add_to_rows(part.left * within, part.rows, y);
      } else {
        add_to_rows(part.left * at_columns, part.rows, y);
      }
    });
  }
}

void add_transposed_product(const EntryParts& parts, const RowVectors& x, RowVectors& y) {
  for (const EntryPart& part : parts) {
    with_rows(x, part.rows, [&](const auto& at_rows) {
      const RowVectors within = part.left.transpose() * at_rows;
      if (part.is_product()) {
        add_to_rows(part.right * within, part.columns, y);
      } else {
        add_to_rows(within, part.columns, y);
      }
    });
  }
}

}  // namespace rebounce

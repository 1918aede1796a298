#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace rebounce {

/// Vectors side by side, a row of numbers for each position.
using RowVectors = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Entries between some rows and some columns of a matrix: the product left right^T of narrow
/// matrices or, where `right` is empty, `left` itself.
struct EntryPart {
  std::vector<std::uint32_t> rows, columns;  ///< indices
  Eigen::MatrixXf left;                      ///< [rows][k], or [rows][columns]
  Eigen::MatrixXf right;                     ///< [columns][k], or empty

  bool is_product() const { return right.size() > 0; }
  Eigen::Index value_count() const { return left.size() + right.size(); }
};

/// A matrix as the sum of such parts. Entries in no part are 0.
using EntryParts = std::vector<EntryPart>;

/// Several matrices as sums: of parts that all of them have, and of parts of each.
struct JointEntryParts {
  EntryParts common;
  std::vector<EntryParts> own;  ///< by matrix
};

/// y += M x and y += M^T x for the matrix M that is the sum of `parts`; x and y must not overlap.
void add_product(const EntryParts& parts, const RowVectors& x, RowVectors& y);
void add_transposed_product(const EntryParts& parts, const RowVectors& x, RowVectors& y);

}  // namespace rebounce

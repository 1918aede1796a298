#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "precompute/base/entry_parts.h"
#include "precompute/compression/light_weights.h"

namespace rebounce {

/// A weighted block of all distinct channels, side by side as in WideBlock, whose entries are never
/// read: it only multiplies, by the parts that it is the sum of. Its norm, and that of what remains
/// of it beside some directions, are estimated from its products with random signs (N. Halko,
/// P. G. Martinsson and J. A. Tropp, "Finding structure with randomness", 2011, section 4.3); by
/// some hundredths where many directions have a share in it.
class StructuredBlock {
 public:
  /// The weights of its two sides are null where none are wanted; they must outlive the object.
  struct Sides {
    Eigen::Index rows, columns;
    const ClusterWeight *row_weight, *column_weight;
    bool on_diagonal;
  };

  StructuredBlock(JointEntryParts parts, const Sides& sides, std::uint64_t seed);

  Eigen::Index rows() const { return sides_.rows; }
  Eigen::Index columns() const { return sides_.columns; }
  Eigen::Index matrix_count() const { return static_cast<Eigen::Index>(parts_.own.size()); }
  bool on_diagonal() const { return sides_.on_diagonal; }

  /// The block times [matrices x columns][k].
  Eigen::MatrixXd times(const Eigen::MatrixXf& columns) const;

  /// The transpose of `rows` [rows][k] times the block.
  Eigen::MatrixXd in_directions(const Eigen::MatrixXd& rows) const;

  /// The squared Frobenius norm of the block.
  double energy() const { return images_.squaredNorm(); }

  /// That of what is orthogonal to the orthonormal columns of `range` [rows][k].
  double energy_beside(const Eigen::MatrixXd& range) const;

 private:
  JointEntryParts parts_;
  Sides sides_;
  /// Products with random signs, scaled so that their squares add up to the energy.
  Eigen::MatrixXd images_;
};

}  // namespace rebounce

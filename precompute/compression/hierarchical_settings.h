#pragma once

#include "precompute/lights/validation_error.h"
#include "rebounce/build_settings.h"

namespace rebounce {

struct HierarchicalSettings {
  /// Relative area-weighted L2 error of the indirect irradiance, averaged over lights. Twice the
  /// tolerance takes about 0.6 of the bytes.
  double tolerance = kDefaultTolerance;
  Precision precision = Precision::kQ8;  ///< kF32 takes twice the bytes and is hardly more exact
  /// Whether large blocks may have cluster bases (TransferBlock). Set it for operators that are
  /// applied: from some thousand patches on, cluster bases make the operator smaller, and the cost
  /// of a block then includes the time of its product. Sweeps over compressed form factors do not
  /// support them. Patches are equilibrated (HierarchicalOperator) with cluster bases and wherever
  /// bases are integers.
  bool cluster_bases = true;
  /// The largest error of single lights may be this multiple of the tolerance.
  double largest_over_mean = kLargestOverMean;
};

}  // namespace rebounce

#pragma once

#include "transfer/base/precision.h"

namespace rebounce {

struct HierarchicalSettings {
  /// Relative area-weighted L2 error of the indirect irradiance that lights may have in the mean;
  /// twice the tolerance takes about 0.6 of the bytes.
  double tolerance = 0.005;
  Precision precision = Precision::kQ8;  ///< kF32: twice the bytes, no less error worth mention
  /// Whether it is for applies: large blocks may then be of cluster coefficients (TransferBlock),
  /// which is smaller from some thousand patches on and which sweeps over compressed form factors
  /// do not know, and blocks are priced by the time that they take, too. Patches are equilibrated
  /// (HierarchicalOperator) in these and wherever bases are integers.
  bool cluster_coefficients = true;
};

}  // namespace rebounce

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "rebounce/precompute/progress.h"
#include "rebounce/transfer/dense_operator.h"
#include "rebounce/transfer/hierarchical_operator.h"
#include "rebounce/transfer/patch_roles.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

struct HierarchicalSettings {
  /// Relative area-weighted L2 error of the indirect irradiance that lights may have in the mean;
  /// twice the tolerance takes about 0.6 of the bytes.
  double tolerance = 0.005;
  Precision precision = Precision::kQ8;  ///< kF32: twice the bytes, no less error worth mention
  /// Whether it is for applies: large blocks may then be of moments (TransferBlock), which is
  /// smaller from some thousand patches on and which sweeps over compressed form factors do not
  /// know, and blocks are priced by the time that they take, too. Patches are equilibrated
  /// (HierarchicalOperator) in these and wherever bases are integers.
  bool moments = true;
};

/// Lights that the operator is fitted to, each an initial exitance [n] in lx.
struct FittingLights {
  /// What light patches give off: errors in what such lights do weigh more than others.
  std::span<const std::vector<Float3>> shaping;
  /// Those that the tolerance is held under. Others than the first, or the error looks smaller than
  /// it is.
  std::span<const std::vector<Float3>> judging;
};

/// Compresses a dense operator (f32) so coarsely that an error of one in the square of the
/// Frobenius norm of Yhat, with the weights that the `shaping` lights give (light_weights.h), is
/// worth 1 / `price` stored values. A uniform light is always among them. With `roles`, only what
/// the light of sources does to receivers is looked at and stored. Throws Cancelled if asked to
/// stop.
HierarchicalOperator::Storage compress_transfer(const DenseOperator& dense,
                                                const PatchTable& patches,
                                                std::span<const std::vector<Float3>> shaping,
                                                double price, const Progress& progress = {},
                                                const PatchRoles& roles = {});

/// The smallest such operator whose errors under the judging lights are well within the tolerance
/// in the mean, and within three times of it at most, found in a few rounds. From round to round,
/// shaping lights that came out badly get more weight. If no operator is within, the most exact
/// one: measure it. With `roles`, the errors are those at receivers, of what sources give off.
std::shared_ptr<const HierarchicalOperator> build_hierarchical_transfer(
    const DenseOperator& dense, const PatchTable& patches, const FittingLights& lights,
    const HierarchicalSettings& settings, const Progress& progress = {},
    const PatchRoles& roles = {});

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/compression/block_checkpoint.h"
#include "precompute/compression/hierarchical_settings.h"
#include "precompute/compression/light_weights.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/patches/cluster_tree.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// How blocks are cut and errors weighed in an operator over some patches.
struct CompressionFrame {
  ClusterTree tree;
  Eigen::VectorXd background;  ///< as background_light gives it
  Eigen::MatrixXd sample;      ///< the training lights, normalised
  PatchRoles roles;            ///< of the matrix
  double received_part = 1;    ///< ReceivedLight::part of the training lights

  /// What a value is worth where that is `usual` with all patches receivers: squares of errors are
  /// relative to those of what arrives.
  double multiplier_for(double usual) const { return usual * received_part * received_part; }

  /// Goes over to the coordinates of a matrix K that leaves the background of all lights about 1,
  /// EquilibratedMatrix: x becomes R x. Returns R as powers of two, by position.
  std::vector<std::int8_t> balance();

  std::vector<ClusterWeight> weights() const {
    return make_cluster_weights(tree, sample, background, roles);
  }
};

/// That of `matrix` under these lights; only its products and energies are asked for.
CompressionFrame compression_frame(const SymmetricMatrix& matrix, const PatchTable& patches,
                                   std::span<const std::vector<Float3>> training);

/// What a value per patch is worth at the tolerance: that with which searches begin, or near it.
double initial_multiplier(double tolerance, std::size_t patch_count);

/// Compresses `matrix` as compress_transfer does. `patches` are those of the matrix.
HierarchicalStorage compress_matrix(const SymmetricMatrix& matrix, const PatchTable& patches,
                                    std::span<const std::vector<Float3>> training,
                                    double multiplier, const Progress& progress = {});

/// Compresses `matrix` to a tolerance as build_hierarchical_transfer does. What each round of the
/// search does is kept in `checkpoint`, made for all that is given here, and taken from there: the
/// bits are the same.
std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches, const FittingLights& lights,
    const HierarchicalSettings& settings, const Progress& progress = {},
    const BlockCheckpoint& checkpoint = {});

}  // namespace rebounce

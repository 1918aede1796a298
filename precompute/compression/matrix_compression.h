#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/compression/block_checkpoint.h"
#include "precompute/compression/block_tree.h"
#include "precompute/compression/equilibrated_matrix.h"
#include "precompute/compression/light_weights.h"
#include "precompute/lights/reference_lighting.h"
#include "precompute/patches/cluster_tree.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// The cluster tree and the weights of errors for operators over some patches.
struct CompressionFrame {
  ClusterTree tree;
  Eigen::VectorXd background;  ///< from background_light
  Eigen::MatrixXd sample;      ///< the training lights, normalised
  PatchRoles roles;            ///< of the matrix
  /// The group of each patch, [n]; empty if all are of one (SymmetricMatrix::group).
  std::vector<std::uint8_t> group;
  double received_part = 1;  ///< ErrorReference::part of the training lights

  /// Scales a multiplier, `usual` with all patches as receivers, to these roles: squared errors are
  /// relative to the light that arrives at receivers.
  double multiplier_for(double usual) const { return usual * received_part * received_part; }

  /// Changes to the coordinates of a matrix K (EquilibratedMatrix) in which the background of all
  /// lights is about 1: x becomes R x. Returns the exponents of R, powers of two, by position.
  std::vector<std::int8_t> balance();

  /// Changes the coordinates: x becomes 2^`exponent` x, by position.
  void scale(std::span<const std::int8_t> exponent);

  std::vector<ClusterWeight> weights() const {
    return make_cluster_weights(tree.clusters, sample, background, roles);
  }
};

/// The frame of `matrix` under these lights. Only products and energies of the matrix are used.
CompressionFrame compression_frame(const SymmetricMatrix& matrix, const PatchTable& patches,
                                   std::span<const std::vector<Float3>> training);

/// What an operator has beside blocks of low rank.
struct CompressionOptions {
  bool equilibrated = false, nested = false;
};

/// The folder that keeps the finished parts of a compression, and their names in it.
struct KeptParts {
  const BlockCheckpoint& checkpoint;
  std::string prefix;
};

/// A compressor of one matrix with all that it looks at.
class MatrixCompression {
 public:
  /// `matrix` must outlive the object; `training` are its training lights.
  MatrixCompression(const SymmetricMatrix& matrix, const PatchTable& patches,
                    std::vector<std::vector<Float3>> training, const PartSizes& sizes = {},
                    const CompressionOptions& options = {});

  /// The operator (f32) at a multiplier > 0, as found in `kept` or kept there. Throws Cancelled if
  /// asked to stop.
  HierarchicalStorage at(double multiplier, const KeptParts& kept,
                         const Progress& progress = {}) const;

  /// CompressionFrame::multiplier_for.
  double multiplier_for(double usual) const { return frame_.multiplier_for(usual); }

  /// Gives the training lights weight by the errors that they have with `transfer`.
  void emphasise(const TransferOperator& transfer);

  /// Adds light k of `lights`, of the same matrix, to the training lights. Where it shines far more
  /// than training lights do, positions are rounded more finely from then on.
  void add_training_light(const ReferenceLighting& lights, std::size_t k);

 private:
  /// Makes K larger at positions where the last training light has much of its energy.
  void round_finer_where_lit();

  const SymmetricMatrix& matrix_;
  PartSizes sizes_;
  bool nested_;
  ReferenceLighting truth_;
  CompressionFrame frame_;
  std::vector<std::int8_t> exponent_;  ///< by position, as EquilibratedMatrix has them
  std::vector<std::int8_t> finer_;     ///< by how much they are below those of the background
  std::optional<EquilibratedMatrix> equilibrated_;
};

/// Compresses `matrix` as compress_transfer does; `patches` are those of the matrix.
HierarchicalStorage compress_matrix(const SymmetricMatrix& matrix, const PatchTable& patches,
                                    std::span<const std::vector<Float3>> training,
                                    double multiplier, const Progress& progress = {});

}  // namespace rebounce

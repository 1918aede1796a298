#pragma once

// The sets of patches by which a group of receivers sees the scene.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/cluster_tree.h"
#include "rebounce/types.h"

namespace rebounce {

/// What all groups share: the patches in the order of a tree whose leaves are single patches, and
/// lights to choose sets by.
struct ReceiverSources {
  ClusterTree tree;
  std::vector<std::uint32_t> position;  ///< [n] of each patch in tree.patch
  std::vector<double> area_before;      ///< [n + 1] m², of the patches at positions before
  Eigen::MatrixXf light;                ///< [n][lights] radiosity at each position
  Eigen::MatrixXd light_before;         ///< [n + 1][lights] sums of radiosity times area
  /// Light that one lumen on any patch brings to places that do not see the patch, lx.
  double everywhere = 0;

  ReceiverSources(const PatchTable& patches, std::span<const std::vector<Float3>> radiosity);
};

/// Rows of a group, as differences from those of the reconstruction weights.
struct GroupRows {
  std::vector<std::uint32_t> position;  ///< [columns] of the patches, ascending
  Eigen::MatrixXf part;                 ///< [receivers][columns]
  Eigen::VectorXf light;                ///< [lights] what the error under each is relative to, lx
};

struct ReceiverSetSettings {
  double tolerance = 0;  ///< relative error of the light at which no set is divided any more
  std::uint32_t most_sets = 0;
  double single_patch = 0;  ///< weight of lights that fall on one patch, against the others
};

/// Chooses clusters of the tree, by ascending position; clusters of which no receiver sees more or
/// less than its weights do are left out. From the root down, the cluster is divided that errs most
/// if it is taken as shining evenly, until the tolerance or the number is reached. The error counts
/// the lights of `sources` and, weighted by settings.single_patch, lights that fall on a single
/// patch, drawn by area: those show what leaks from a very bright patch to all that see its set.
std::vector<std::uint32_t> choose_sets(const ReceiverSources& sources, const GroupRows& rows,
                                       const ReceiverSetSettings& settings);

}  // namespace rebounce

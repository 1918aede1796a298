#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/rays/patch_points.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// What a vertex takes from one patch.
struct PatchWeight {
  std::uint32_t patch;
  double weight;
};

/// What is shown at a vertex: ascending by patch, the sum of the weights is 1; or empty.
using VertexWeights = std::vector<PatchWeight>;

struct MeanPreservation {
  double most_negative;      ///< sum of the negative weights of a vertex, at most
  std::size_t most_patches;  ///< weights of a vertex, at most: the largest are kept
};

/// Takes back most of what smoothing loses: vertices that show means over patches, and triangles
/// that interpolate between them, flatten every peak twice. To the value of each patch is added
/// what it has more than the mean of what is shown on it (Van Cittert 1931), written into the
/// weights of the vertices; twice. Some weights become negative; constant and linear light stay as
/// they are.
///
/// `weight` [v] is not negative at first. `triangles` are those of the patches, `good` [n] is not 0
/// for patches whose means can be trusted: where others are shown nothing is changed.
void preserve_patch_means(const DisplayMesh& mesh, const PatchTriangles& triangles,
                          std::span<const std::uint8_t> good, const MeanPreservation& settings,
                          std::vector<VertexWeights>& weight);

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/rays/patch_points.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The weight of one patch at a vertex.
struct PatchWeight {
  std::uint32_t patch;
  double weight;
};

/// The weights of a vertex: ascending by patch with a sum of 1, or empty.
using VertexWeights = std::vector<PatchWeight>;

struct MeanPreservation {
  double most_negative;      ///< limit of the sum of negative weights of a vertex
  std::size_t most_patches;  ///< limit of the number of weights of a vertex; the largest are kept
};

/// Undoes most of the smoothing of vertices that show means over patches and of triangles that
/// interpolate between them. Adds to the value of each patch its difference from the mean shown on
/// it, written into the weights of the vertices; twice (P. H. van Cittert, 1931). Some weights
/// become negative; constant and linear light stay as they are.
///
/// `weight` [v] is not negative before the call. `triangles` are those of the patches. `good` [n]
/// is nonzero for patches with a trustworthy mean; where others are shown nothing changes.
void preserve_patch_means(const DisplayMesh& mesh, const PatchTriangles& triangles,
                          std::span<const std::uint8_t> good, const MeanPreservation& settings,
                          std::vector<VertexWeights>& weight);

}  // namespace rebounce

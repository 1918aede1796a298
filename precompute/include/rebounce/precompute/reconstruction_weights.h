#pragma once

#include <span>

#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// Fills mesh.weight_begin, weight_patch and weight: the value at a vertex is the mean over the
/// patches that meet at its position on the same side of any crease (normals within 40 degrees),
/// weighted by the angle they take up there. Vertices of sides without patches get no weights.
///
/// `shown_patch` [t] is the patch of each display triangle, or kNone.
/// `absorbed` [n] is the part of each patch's view that meets back faces. Where that is not zero,
/// the patch is partly covered (a box stands on that part of the floor) and its mean is too dark
/// for the part that is seen, by just that factor: weights are such that the sum of weight x (1 -
/// absorbed) is 1. Patches that are all but covered are left out.
void compute_reconstruction_weights(std::span<const std::uint32_t> shown_patch,
                                    std::span<const float> absorbed, DisplayMesh& mesh);

}  // namespace rebounce

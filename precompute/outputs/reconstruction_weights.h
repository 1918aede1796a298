#pragma once

#include <span>

#include "precompute/base/progress.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Fills mesh.weight_begin, weight_patch and weight. A vertex uses at most 16 patches around it on
/// the same side of any crease (normals within 40 degrees), about in its plane and visible; near
/// ones weigh more. The weights are shifted to balance about the vertex, and then sharpened so that
/// the mean shown on a patch is the value of the patch (notes/concepts/outputs.md). Some weights
/// are negative. Vertices of sides without patches get no weights.
///
/// A patch that is open only in part (the edge of a rug lies on it, a wall cuts through it) has a
/// mean that belongs to neither part. Short rays above patches find these. Vertices then use
/// patches that are open everywhere, if necessary from farther away, so that no dark or bright edge
/// shows around things that stand or hang close to a surface.
///
/// `shown_patch` [t] is the patch of each display triangle, or kNone. `absorbed` [n] is the
/// fraction of the view of each patch that meets back faces. Where only such patches are left, the
/// weights compensate for it: the sum of weight x (1 - absorbed) is 1. `tracer` holds the surface
/// of `mesh`. Throws Cancelled if asked to stop.
void compute_reconstruction_weights(std::span<const std::uint32_t> shown_patch,
                                    std::span<const float> absorbed, const RayTracer& tracer,
                                    DisplayMesh& mesh, const Progress& progress = {});

}  // namespace rebounce

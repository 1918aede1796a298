#pragma once

#include <span>

#include "precompute/base/progress.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Fills mesh.weight_begin, weight_patch and weight: a vertex takes from at most 16 patches around
/// it on the same side of any crease (normals within 40 degrees), about in its plane and in sight,
/// nearer ones more; their weights are drawn to balance about the vertex and then sharpened so that
/// what is shown on a patch keeps the patch's mean (notes/patches.md). Some weights are negative.
/// Vertices of sides without patches get no weights.
///
/// A patch of which only a part is in the open (the rim of a rug lies on it, a wall cuts through
/// it) has a mean that belongs to neither part. Such patches are told by short rays above them;
/// vertices take their value from patches that lie in the open all over, if need be from farther
/// away, so that no dark or bright rim shows around what stands or hangs close to a surface.
///
/// `shown_patch` [t] is the patch of each display triangle, or kNone. `absorbed` [n] is the part of
/// each patch's view that meets back faces; where nothing better is left, the weights make up for
/// it: the sum of weight x (1 - absorbed) is 1. `tracer` holds the surface of `mesh`.
/// Throws Cancelled.
void compute_reconstruction_weights(std::span<const std::uint32_t> shown_patch,
                                    std::span<const float> absorbed, const RayTracer& tracer,
                                    DisplayMesh& mesh, const Progress& progress = {});

}  // namespace rebounce

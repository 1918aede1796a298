#pragma once

#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// Fills mesh.weight_begin, weight_patch and weight: the value at a vertex is the mean over the
/// patches that meet at its position on the same side of any crease (normals within 40 degrees),
/// weighted by the angle they take up there. Vertices of sides without patches get no weights.
void compute_reconstruction_weights(DisplayMesh& mesh);

}  // namespace rebounce

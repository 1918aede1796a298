#pragma once

#include <filesystem>

#include "precompute/facets/facets.h"

namespace rebounce {

/// Reads facets from a file, in its order: STL, binary or text (.stl), Wavefront OBJ (.obj: faces
/// "f" of any number of corners), or View3D (.vs3: surfaces "S", obstructions "O" and their
/// emissivities). Throws Error, one line with the place, if the file cannot be read or used.
Facets read_facets(const std::filesystem::path& path);

}  // namespace rebounce

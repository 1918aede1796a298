#pragma once

#include <cstddef>

#include "precompute/import/scene.h"
#include "precompute/patches/subdivision.h"

namespace rebounce {

/// Splits the scene's triangles along the lines where others pass through them or stand on them
/// (contacts.h), so that no patch lies on two sides of a wall. The mesh stays conforming, no area
/// is lost and no surface changes; parts of one triangle follow one another.
///
/// Triangles are bisected around such lines until they are about as large as the patches that
/// `settings` ask for; free vertices near a line are then moved onto it, and edges that still cross
/// it are split there. Lines shorter than half of a patch are left alone, and so are the shortest
/// ones once half as many triangles as wanted patches have been added: a detailed object does not
/// shred the floor it stands on. Deterministic.
void cut_at_contacts(Scene& scene, const SubdivisionSettings& settings);

}  // namespace rebounce

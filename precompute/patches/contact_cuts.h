#pragma once

#include <cstddef>

#include "precompute/import/scene.h"
#include "precompute/patches/subdivision.h"

namespace rebounce {

/// Splits triangles of the scene along the lines where other surfaces pass through them or stand on
/// them (contacts.h), so that no patch lies on two sides of a wall. The mesh stays conforming, and
/// neither area nor surface changes; parts of one triangle follow one another.
///
/// Triangles are bisected around such lines until they are about as large as the patches that
/// `settings` ask for. Free vertices near a line are then moved onto it, and edges that still cross
/// it are split. Lines shorter than half a patch are ignored. The shortest lines are also ignored
/// once half as many triangles as wanted patches have been added, so that a detailed object does
/// not shred the floor that it stands on. Deterministic.
void cut_at_contacts(Scene& scene, const SubdivisionSettings& settings);

}  // namespace rebounce

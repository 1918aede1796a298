#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/import/scene.h"
#include "precompute/patches/subdivision.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Higher reflectances are clamped to this value, so that the light of infinitely many bounces is
/// finite.
inline constexpr float kMaxReflectance = 0.99F;

/// The scene as patches: what is displayed, and what exchanges light.
struct PatchModel {
  PatchTable patches;  ///< sky_visibility and absorbed are filled with the form factors
  DisplayMesh mesh;
  /// [t] The patch whose light a display triangle shows: its own, or that of the surface that
  /// covers it; kNone for a side that sees nothing.
  std::vector<std::uint32_t> shown_patch;
  std::vector<std::uint32_t> triangle_mesh;  ///< [t] in Scene::placed_meshes, or empty
  /// [v] of the mesh, or empty: see Scene. Both sides of a double-sided triangle have the same.
  std::vector<LightmapTexcoord> lightmap_texcoord;
  std::vector<std::string> lightmap_page;
  std::size_t element_count = 0;         ///< lit sides, which patches are made of
  std::size_t scene_triangle_count = 0;  ///< before subdivision, without slivers
  std::size_t sliver_count = 0;          ///< triangles thinner than the precision of rays, dropped
  std::size_t unlit_side_count = 0;      ///< sides of display triangles that see nothing: no patch
  std::size_t covered_side_count = 0;  ///< sides that lie in another surface: no patch of their own
  std::size_t opening_side_count = 0;  ///< sides that stop no light: no patch
  std::size_t buried_side_count = 0;   ///< sides inside solids and shells: no patch
  std::vector<std::string> warnings;
};

/// Subdivides large triangles of the scene (subdivision.h) and merges small ones: every lit side
/// (lit_sides.h) is an element of one patch (element_clusters.h). Area, reflectance and emission
/// are those of the surface that stops light (opacity_maps.h), textures integrated. Double-sided
/// triangles get a second display triangle. The reconstruction weights are left to
/// reconstruction_weights.h. Throws Error if nothing of the scene can have patches, Cancelled if
/// asked to stop.
PatchModel make_patch_model(Scene scene, const SubdivisionSettings& settings,
                            const Progress& progress = {});

}  // namespace rebounce

#pragma once

#include <filesystem>
#include <vector>

#include "precompute/import/scene.h"
#include "rebounce/lights.h"

namespace rebounce {

/// Imports the default scene of a .glb or .gltf file (the first scene if none is named, every root
/// node if there is no scene).
///
/// Reads triangles, strips and fans, indexed or not, of every component type that glTF allows,
/// sparse and interleaved accessors, Draco and meshopt compression, instances, any node transform;
/// PNG, JPEG and WebP; base colour, emission, double-sidedness; KHR_lights_punctual and cameras.
/// Throws Error, one line, for invalid data and for required features that are not supported;
/// things that can be left out safely are counted or become a warning.
///
/// `scale` is the length of the unit of the asset in metres, > 0. It multiplies positions of all
/// kinds and the ranges of lights; intensities stay.
Scene import_gltf(const std::filesystem::path& path, double scale = 1);

/// The lights of the same scene alone, which may be none; there need be no triangles.
std::vector<Light> import_gltf_lights(const std::filesystem::path& path, double scale = 1);

}  // namespace rebounce

#pragma once

#include <filesystem>

#include "precompute/import/scene.h"

namespace rebounce {

/// Imports the default scene of a .glb or .gltf file (the first scene where none is named, every
/// root node where there is no scene).
///
/// Takes triangles, strips and fans, indexed or not, of every component type that glTF allows,
/// sparse and interleaved accessors, Draco and meshopt compression, instances, any node transform;
/// PNG, JPEG and WebP; base colour, emission, double-sidedness;
/// KHR_lights_punctual and cameras. Throws Error, one line, for anything that cannot be trusted or
/// is required and not supported; what can be left out safely is counted or becomes a warning.
///
/// `scale` is how many metres the asset's unit has, > 0: it multiplies positions of all kinds and
/// the ranges of lights, and leaves intensities as they are.
Scene import_gltf(const std::filesystem::path& path, double scale = 1);

}  // namespace rebounce

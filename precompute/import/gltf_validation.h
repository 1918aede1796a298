#pragma once

#include <nlohmann/json_fwd.hpp>

namespace rebounce::gltf {

/// Throws Error where the asset needs a glTF version, or an extension, that is not supported.
void check_version_and_extensions(const nlohmann::json& root);

/// Checks everything in the JSON that the importer will use, and that tinygltf would take on trust:
/// that what should be an array, object or number is one, that every index lies inside its
/// array, that vectors have their length. Throws Error that names the first offence.
///
/// Brings numbers into the form that tinygltf reads without loss: sizes and indices that were
/// written as 3.0 become integers, reals that were written as 3 become floating point.
void check_structure(nlohmann::json& root);

}  // namespace rebounce::gltf

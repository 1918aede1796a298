#pragma once

#include <nlohmann/json_fwd.hpp>

namespace rebounce::gltf {

/// Throws Error if the asset needs an unsupported glTF version or extension.
void check_version_and_extensions(const nlohmann::json& root);

/// Checks everything in the JSON that the importer uses and tinygltf does not check: arrays,
/// objects and numbers have the right type, every index lies inside its array, vectors have the
/// right length. Throws Error that names the first violation.
///
/// Converts numbers to the form that tinygltf reads without loss: sizes and indices written as 3.0
/// become integers, reals written as 3 become floating point.
void check_structure(nlohmann::json& root);

}  // namespace rebounce::gltf

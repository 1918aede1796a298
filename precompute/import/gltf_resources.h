#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace rebounce::gltf {

/// The data of a URI of an asset.
struct Resource {
  std::vector<std::uint8_t> bytes;
  bool external = false;  ///< from a separate file, not from a data URI
};

/// Reads the data of `uri`: a base64 data URI, or a file with a relative path that stays inside
/// `folder` (percent-encoding is decoded). Throws Error for any other URI, and if the data cannot
/// be read.
Resource read_resource(const std::filesystem::path& folder, const std::string& uri);

/// Throws Error if read_resource refuses `uri` without reading the disk: an absolute path, a path
/// that leaves the folder, another scheme.
void check_uri(const std::filesystem::path& folder, const std::string& uri);

}  // namespace rebounce::gltf

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace rebounce::gltf {

/// What a URI of an asset led to.
struct Resource {
  std::vector<std::uint8_t> bytes;
  bool external = false;  ///< from a file of its own, not from a data URI
};

/// Reads what `uri` names: a base64 data URI, or a file by a relative path that stays inside
/// `folder` (percent-encoding is undone). Throws Error for every other URI, and where the data
/// cannot be had.
Resource read_resource(const std::filesystem::path& folder, const std::string& uri);

/// Throws Error where read_resource would refuse `uri` on principle, whatever is on the disk: an
/// absolute path, one that leaves the folder, another scheme.
void check_uri(const std::filesystem::path& folder, const std::string& uri);

}  // namespace rebounce::gltf

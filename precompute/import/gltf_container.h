#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <vector>

namespace rebounce::gltf {

using Bytes = std::span<const std::uint8_t>;

/// The two parts of a .glb file, as views into its bytes; a .gltf file has a JSON part only.
struct Container {
  Bytes json;
  std::optional<Bytes> binary;
};

/// Reads a regular file whole. Throws Error where there is none or it cannot be read.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path);

/// Splits a file into its chunks. A file that starts with "glTF" is taken for a .glb and must have
/// a sound header and chunks (Error otherwise); everything else is taken for JSON.
Container split_container(Bytes file);

/// Parses the JSON part. Throws Error where it is not JSON, not an object, or nested so deeply that
/// reading it recursively could exhaust the stack.
nlohmann::json parse_json(Bytes text);

}  // namespace rebounce::gltf

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

/// Reads a whole regular file. Throws Error if there is none or it cannot be read.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path);

/// Splits a file into its chunks. A file that starts with "glTF" must be a .glb with a valid header
/// and valid chunks (otherwise Error); any other file counts as JSON.
Container split_container(Bytes file);

/// Parses the JSON part. Throws Error if it is not JSON, is not an object, or is nested so deeply
/// that recursive reading could exhaust the stack.
nlohmann::json parse_json(Bytes text);

}  // namespace rebounce::gltf

#include "precompute/import/gltf_container.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>

#include "precompute/import/parsed_json.h"
#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67;        // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;

// tinygltf takes the length as 32 bits, and its base64 decoder counts in int.
constexpr std::size_t kMaxJsonBytes = std::size_t{1} << 30;

std::uint32_t read_u32(Bytes bytes, std::size_t offset) {
  return static_cast<std::uint32_t>(bytes[offset]) |
         static_cast<std::uint32_t>(bytes[offset + 1]) << 8 |
         static_cast<std::uint32_t>(bytes[offset + 2]) << 16 |
         static_cast<std::uint32_t>(bytes[offset + 3]) << 24;
}

struct Chunk {
  std::uint32_t type;
  Bytes data;
};

// Removes the next chunk from the front of `rest`.
Chunk next_chunk(Bytes& rest) {
  if (rest.size() < kChunkHeaderBytes) {
    throw Error("the .glb is truncated in the header of a chunk; get a complete copy");
  }
  const std::size_t length = read_u32(rest, 0);
  if (length > rest.size() - kChunkHeaderBytes) {
    throw Error(
        fmt::format("the .glb is truncated: a chunk of {} bytes has only {}; get a complete copy",
                    length, rest.size() - kChunkHeaderBytes));
  }
  const Chunk chunk{read_u32(rest, 4), rest.subspan(kChunkHeaderBytes, length)};
  rest = rest.subspan(kChunkHeaderBytes + length);
  return chunk;
}

// Throws Error if a file that is no .glb cannot be a .gltf either.
void check_is_json(Bytes file) {
  constexpr std::size_t kLengthBytes = 8;  // of a header of safetensors, which is JSON
  constexpr std::array<std::uint8_t, 3> kByteOrderMark{0xEF, 0xBB, 0xBF};
  const auto is_before_json = [&](std::uint8_t c) {
    return std::isspace(c) != 0 || std::ranges::find(kByteOrderMark, c) != kByteOrderMark.end();
  };
  const auto first = std::ranges::find_if_not(file, is_before_json);
  if (first != file.end() && *first == '{') return;
  if (file.size() > kLengthBytes && file[kLengthBytes] == '{' && file[kLengthBytes - 1] == 0) {
    throw Error(
        "this is a safetensors file, as precompute writes them, and not a scene; name the .glb or "
        ".gltf that it was made of");
  }
  throw Error("this is not glTF: neither a .glb nor a JSON object; export the scene as glTF 2.0");
}

}  // namespace

std::vector<std::uint8_t> read_file(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) throw Error("there is no such file");
  const std::uintmax_t size = std::filesystem::file_size(path, failure);
  std::ifstream stream(path, std::ios::binary);
  if (failure || !stream) throw Error("the file cannot be opened for reading");
  std::vector<std::uint8_t> bytes(size);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream) throw Error("the file could not be read to its end");
  return bytes;
}

Container split_container(Bytes file) {
  if (file.size() < 4 || read_u32(file, 0) != kMagic) {
    check_is_json(file);
    return {file, std::nullopt};
  }
  if (file.size() < kHeaderBytes)
    throw Error("the .glb is truncated in its header; get a complete copy");
  if (const auto version = read_u32(file, 4); version != 2) {
    throw Error(fmt::format("the .glb container has version {}; only version 2 is read", version));
  }
  const std::size_t length = read_u32(file, 8);
  if (length < kHeaderBytes || length > file.size()) {
    throw Error(
        fmt::format("the .glb is truncated: its header says {} bytes and {} are there; get a "
                    "complete copy",
                    length, file.size()));
  }
  Bytes rest = file.subspan(kHeaderBytes, length - kHeaderBytes);
  const Chunk json = next_chunk(rest);
  if (json.type != kJsonChunk) throw Error("the first chunk of the .glb is not JSON");
  Container container{json.data, std::nullopt};
  if (!rest.empty()) {
    const Chunk second = next_chunk(rest);
    if (second.type == kBinaryChunk) container.binary = second.data;
  }
  return container;
}

nlohmann::json parse_json(Bytes text) {
  if (text.size() > kMaxJsonBytes) throw Error("the JSON part is larger than 1 GiB");
  auto root =
      parse_json_text({reinterpret_cast<const char*>(text.data()), text.size()}, "the JSON");
  if (!root.is_object()) throw Error("this is not glTF: the JSON is not an object");
  return root;
}

}  // namespace rebounce::gltf

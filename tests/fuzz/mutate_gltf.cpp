// Changes the JSON or the binary chunk of a .glb, with lengths that agree, or the JSON of a .gltf.

#include <cstring>

#include "tests/fuzz/json_mutation.h"

namespace rebounce::fuzz {
namespace {

constexpr std::size_t kHeader = 12, kChunkHeader = 8;

std::uint32_t read_u32(const std::string& bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

void append_u32(std::string& bytes, std::size_t value) {
  const auto stored = static_cast<std::uint32_t>(value);
  bytes.append(reinterpret_cast<const char*>(&stored), sizeof(stored));
}

void append_chunk(std::string& bytes, const char* type, std::string data, char padding) {
  data.resize((data.size() + 3) / 4 * 4, padding);
  append_u32(bytes, data.size());
  bytes.append(type, 4);
  bytes += data;
}

// The length of the buffer of the binary chunk follows that chunk.
std::string with_length(const std::string& text, std::size_t length) {
  auto root = nlohmann::json::parse(text, nullptr, false);
  if (!root.is_object() || !root.contains("buffers") || !root["buffers"].is_array() ||
      root["buffers"].empty() || !root["buffers"][0].is_object()) {
    return text;
  }
  root["buffers"][0]["byteLength"] = length;
  return root.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string mutated_glb(const std::string& file, Random& random, std::size_t most) {
  const std::size_t json_size = read_u32(file, kHeader);
  const std::size_t json_end = kHeader + kChunkHeader + json_size;
  if (json_size > file.size() || json_end > file.size()) return mutated_bytes(file, most);
  std::string text = file.substr(kHeader + kChunkHeader, json_size);
  std::string binary = file.substr(std::min(json_end + kChunkHeader, file.size()));
  const bool has_binary = !binary.empty();
  if (has_binary && below(random, 2) == 0) {
    binary = mutated_bytes(binary, binary.size() + 64);
    text = with_length(text, binary.size());
  } else {
    text = mutated_json_text(text, random, most);
  }
  std::string chunks;
  append_chunk(chunks, "JSON", text, ' ');
  if (has_binary) append_chunk(chunks, "BIN\0", binary, '\0');
  std::string mutated("glTF\2\0\0\0", 8);
  append_u32(mutated, kHeader + chunks.size());
  return mutated + chunks;
}

}  // namespace
}  // namespace rebounce::fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  using namespace rebounce::fuzz;
  Random random(seed);
  const std::string file(reinterpret_cast<const char*>(data), size);
  if (below(random, 16) == 0) return LLVMFuzzerMutate(data, size, most);
  const bool is_glb = size >= kHeader + kChunkHeader && file.starts_with("glTF");
  return give_back(is_glb ? mutated_glb(file, random, most) : mutated_json_text(file, random, most),
                   data, most);
}

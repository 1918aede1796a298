// Changes the header of a transfer file, or one tensor: its bytes, its size, or that it is there.
// Offsets and the length of the header agree with the rest, so that the checks behind are reached.

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "tests/fuzz/json_mutation.h"

namespace rebounce::fuzz {
namespace {

using nlohmann::json;

constexpr const char* kMetadata = "__metadata__";

struct Tensor {
  std::string name;
  json description;
  std::string bytes;
};

/// A safetensors file in parts. Without tensors if the bytes are none.
struct File {
  json metadata;
  std::vector<Tensor> tensors;  ///< in the order of the file

  explicit File(const std::string& bytes) {
    std::uint64_t length = 0;
    if (bytes.size() < sizeof(length)) return;
    std::memcpy(&length, bytes.data(), sizeof(length));
    if (length > bytes.size() - sizeof(length)) return;
    const json header = json::parse(bytes.substr(sizeof(length), length), nullptr, false);
    if (!header.is_object()) return;
    const std::string data = bytes.substr(sizeof(length) + length);
    for (const auto& [name, value] : header.items()) {
      if (name == kMetadata) {
        metadata = value;
      } else if (const auto range = range_of(value, data.size()); range.second >= range.first) {
        tensors.push_back({name, value, data.substr(range.first, range.second - range.first)});
      }
    }
    std::ranges::sort(tensors, {}, [](const Tensor& t) { return range_of(t.description, ~0UL); });
  }

  std::string text() const {
    json header = json::object();
    if (!metadata.is_null()) header[kMetadata] = metadata;
    std::string data;
    for (const Tensor& tensor : tensors) {
      json& described = header[tensor.name] = tensor.description;
      if (described.is_object()) {
        described["data_offsets"] = {data.size(), data.size() + tensor.bytes.size()};
      }
      data += tensor.bytes;
    }
    std::string head = header.dump(-1, ' ', false, json::error_handler_t::replace);
    const std::uint64_t unpadded = sizeof(std::uint64_t) + head.size();
    head.append((64 - unpadded % 64) % 64, ' ');
    const std::uint64_t length = head.size();
    return std::string(reinterpret_cast<const char*>(&length), sizeof(length)) + head + data;
  }

 private:
  // {1, 0} if there is none.
  static std::pair<std::size_t, std::size_t> range_of(const json& description, std::size_t most) {
    if (!description.is_object() || !description.contains("data_offsets")) return {1, 0};
    const json& range = description["data_offsets"];
    if (!range.is_array() || range.size() != 2 || !range[0].is_number_unsigned() ||
        !range[1].is_number_unsigned()) {
      return {1, 0};
    }
    const std::size_t begin = range[0].get<std::size_t>(), end = range[1].get<std::size_t>();
    return end <= most && begin <= end ? std::pair{begin, end}
                                       : std::pair<std::size_t, std::size_t>{1, 0};
  }
};

// One size of the shape changes, and the bytes with it.
void resize(Tensor& tensor, Random& random) {
  json& shape = tensor.description["shape"];
  if (!shape.is_array() || shape.empty()) return;
  json& size = shape[below(random, shape.size())];
  if (!size.is_number_unsigned()) return;
  const std::size_t before = size.get<std::size_t>();
  const std::size_t choices[] = {before + 1, before - std::min<std::size_t>(before, 1), 0,
                                 2 * before};
  const std::size_t after = choices[below(random, 4)];
  if (before == 0 || after > 4096) return;
  tensor.bytes.resize(tensor.bytes.size() / before * after);
  size = after;
}

// Values of four bytes, as most are.
void change_values(Tensor& tensor, Random& random) {
  const std::size_t count = tensor.bytes.size() / 4;
  if (count == 0 || below(random, 4) == 0) {
    tensor.bytes = mutated_bytes(tensor.bytes, tensor.bytes.size());
    return;
  }
  constexpr std::uint32_t kValues[] = {0,          1,          2,          0x3F800000, 0xBF800000,
                                       0x7F800000, 0x7FC00000, 0xFFFFFFFF, 0x7FFFFFFF, 0x7F7FFFFF,
                                       0x00000001, 0x80000000, 0x0000FFFF, 0x00010000};
  char* const place = tensor.bytes.data() + 4 * below(random, count);
  std::uint32_t value = 0;
  std::memcpy(&value, place, 4);
  switch (below(random, 4)) {
    case 0:
      value += 1;
      break;
    case 1:
      value -= 1;
      break;
    case 2:
      value ^= 1U << below(random, 32);
      break;
    default:
      value = kValues[below(random, std::size(kValues))];
  }
  std::memcpy(place, &value, 4);
}

void mutate(File& file, Random& random) {
  const std::size_t which = below(random, file.tensors.size());
  Tensor& tensor = file.tensors[which];
  switch (below(random, 16)) {
    case 0:
      file.tensors.erase(file.tensors.begin() + static_cast<std::ptrdiff_t>(which));
      break;
    case 1:
      mutate_json(tensor.description, random);
      break;
    case 2:
    case 3:
      if (file.metadata.is_structured()) mutate_json(file.metadata, random);
      break;
    case 4:
      tensor.bytes = file.tensors[below(random, file.tensors.size())].bytes;
      break;
    case 5:
    case 6:
    case 7:
      if (tensor.description.is_object()) resize(tensor, random);
      break;
    default:
      for (std::size_t k = 1 + below(random, 4); k > 0; --k) change_values(tensor, random);
  }
}

}  // namespace
}  // namespace rebounce::fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  using namespace rebounce::fuzz;
  Random random(seed);
  File file(std::string(reinterpret_cast<const char*>(data), size));
  if (file.tensors.empty() || below(random, 16) == 0) return LLVMFuzzerMutate(data, size, most);
  mutate(file, random);
  const std::string mutated = file.text();
  return mutated.size() <= most ? give_back(mutated, data, most)
                                : LLVMFuzzerMutate(data, size, most);
}

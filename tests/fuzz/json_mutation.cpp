#include "tests/fuzz/json_mutation.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace rebounce::fuzz {
namespace {

using nlohmann::json;

constexpr std::size_t kMostBytesOfText = 4096;

void collect(json& value, std::vector<json*>& values) {
  values.push_back(&value);
  if (!value.is_structured()) return;
  for (json& item : value) collect(item, values);
}

json another_number(const json& number, Random& random) {
  const std::array<json, 16> numbers{
      0,          1,          2,        3,    -1,  255,   65535, 65536,
      2147483647, 4294967295, 1U << 24, 1e-9, 0.5, 1e308, -1e39, 9007199254740993};
  switch (below(random, 4)) {
    case 0:
      if (number.is_number_integer()) return number.get<std::int64_t>() + 1;
      return number.get<double>() * 2;
    case 1:
      if (number.is_number_integer()) return number.get<std::int64_t>() - 1;
      return -number.get<double>();
    case 2:
      if (number.is_number_integer()) {
        return number.get<std::int64_t>() ^ (std::int64_t{1} << below(random, 24));
      }
      return number.get<double>() + 0.25;
    default:
      return numbers[below(random, numbers.size())];
  }
}

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string from_base64(std::string_view text) {
  std::string bytes;
  std::uint32_t gathered = 0;
  int bits = 0;
  for (const char c : text) {
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) break;
    gathered = gathered << 6 | static_cast<std::uint32_t>(digit);
    bits += 6;
    if (bits >= 8) bytes += static_cast<char>(gathered >> (bits -= 8));
  }
  return bytes;
}

std::string to_base64(const std::string& bytes) {
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t three = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      three = three << 8 | (k + i < bytes.size() ? static_cast<std::uint8_t>(bytes[k + i]) : 0U);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      text += k + i <= bytes.size() ? kDigits[three >> (18 - 6 * i) & 63] : '=';
    }
  }
  return text;
}

// The data of a URI are changed as what they encode.
std::string another_text(const std::string& text, Random& random) {
  constexpr std::string_view kMark = ";base64,";
  const std::size_t mark = text.find(kMark);
  if (mark == std::string::npos || below(random, 8) == 0) {
    return mutated_bytes(text, kMostBytesOfText);
  }
  const std::size_t begin = mark + kMark.size();
  const std::string bytes = from_base64(std::string_view(text).substr(begin));
  return text.substr(0, begin) + to_base64(mutated_bytes(bytes, bytes.size() + 64));
}

void replace(json& value, Random& random) {
  if (value.is_number()) {
    value = another_number(value, random);
  } else if (value.is_string()) {
    value = another_text(value.get<std::string>(), random);
  } else if (value.is_boolean()) {
    value = !value.get<bool>();
  } else if (value.is_array() && !value.empty()) {
    const json item = value[below(random, value.size())];
    value.push_back(item);
  }
}

void erase_from(json& parent, Random& random) {
  if (!parent.is_structured() || parent.empty()) return;
  auto item = parent.begin();
  std::advance(item, static_cast<std::ptrdiff_t>(below(random, parent.size())));
  parent.erase(item);
}

}  // namespace

std::string mutated_bytes(std::string bytes, std::size_t most) {
  const std::size_t size = bytes.size();
  if (size > most) return bytes;
  bytes.resize(std::max<std::size_t>(most, 1));
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
  return bytes;
}

void mutate_json(json& root, Random& random) {
  std::vector<json*> values;
  collect(root, values);
  json& value = *values[below(random, values.size())];
  switch (below(random, 8)) {
    case 0:
      return erase_from(value, random);
    case 1: {
      const json other = *values[below(random, values.size())];
      value = other;
      return;
    }
    case 2: {
      const std::array<json, 6> kinds{nullptr, true, "text", json::array(), json::object(), -1};
      value = kinds[below(random, kinds.size())];
      return;
    }
    default:
      return replace(value, random);
  }
}

std::string mutated_json_text(const std::string& text, Random& random, std::size_t most) {
  json root = json::parse(text, nullptr, false);
  if (root.is_discarded() || below(random, 16) == 0) return mutated_bytes(text, most);
  for (std::size_t k = 1 + below(random, 3); k > 0; --k) mutate_json(root, random);
  return root.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::size_t give_back(const std::string& mutated, std::uint8_t* data, std::size_t most) {
  const std::size_t size = std::min(mutated.size(), most);
  std::copy_n(mutated.begin(), size, data);
  return size;
}

}  // namespace rebounce::fuzz

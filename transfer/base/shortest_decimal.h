#pragma once

#include <array>
#include <charconv>
#include <string>

namespace rebounce {

/// The shortest decimal that reads back as the same number, independent of the locale.
template <typename Number>
std::string shortest_decimal(Number value) {
  std::array<char, 32> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

}  // namespace rebounce

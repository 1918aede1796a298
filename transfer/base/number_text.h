#pragma once

#include <charconv>
#include <concepts>
#include <cstdlib>
#include <string>

namespace rebounce {

/// std::from_chars, with floating-point numbers where the library lacks them (libc++ before 20);
/// those then may have blanks and a + before them too.
template <typename Number>
std::from_chars_result read_number(const char* first, const char* last, Number& value) {
#ifdef __cpp_lib_to_chars
  return std::from_chars(first, last, value);
#else
  if constexpr (std::integral<Number>) {
    return std::from_chars(first, last, value);
  } else {
    const std::string text(first, last);
    char* end = nullptr;
    const double read = std::strtod(text.c_str(), &end);
    if (end == text.c_str()) return {first, std::errc::invalid_argument};
    value = static_cast<Number>(read);
    return {first + (end - text.c_str()), std::errc()};
  }
#endif
}

}  // namespace rebounce

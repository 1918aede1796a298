#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string_view>

namespace rebounce {

/// Parses JSON from an untrusted source. `text` must be one value, nested at most `max_depth` deep,
/// without duplicate keys in an object. Throws Error with the reason; the caller adds the file
/// name.
nlohmann::json parse_untrusted_json(std::string_view text, std::size_t max_depth);

}  // namespace rebounce

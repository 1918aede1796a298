#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string_view>

namespace rebounce {

/// Parses JSON that nobody vouches for: `text` must be one value, nested at most `max_depth` deep,
/// with no key twice in an object. Throws Error with the reason alone; the caller says where.
nlohmann::json parse_untrusted_json(std::string_view text, std::size_t max_depth);

}  // namespace rebounce

#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace rebounce {

/// JSON as text, in lines with an indent of at least 0. What is not UTF-8, as names out of files
/// may be, becomes U+FFFD.
inline std::string json_text(const nlohmann::json& json, int indent = -1) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace rebounce

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace rebounce {

/// Parses JSON from a file. Throws Error if it is none, or is nested so deeply that recursive
/// reading could exhaust the stack. `name` begins the messages.
nlohmann::json parse_json_text(std::string_view text, const std::string& name);

}  // namespace rebounce

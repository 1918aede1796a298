#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

namespace rebounce {

/// What is wrong with a text of `size` bytes that the parser refused, to follow its name in a
/// message: "is truncated: ...", or "is not JSON: ..." with the place.
std::string json_problem(const nlohmann::json::exception& failure, std::size_t size);

}  // namespace rebounce

#include "precompute/import/parsed_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>

#include "precompute/base/json_problem.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

// Real files reach about 15 levels.
constexpr int kMaxJsonDepth = 100;

// The nesting depth of brackets outside strings. It is counted before parsing, because the callback
// of the parser takes quadratic time in the length of an array.
int nesting_depth(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char character = text[i];
    if (in_string && character == '\\') {
      ++i;
    } else if (character == '"') {
      in_string = !in_string;
    } else if (!in_string && (character == '[' || character == '{')) {
      deepest = std::max(deepest, ++depth);
    } else if (!in_string && (character == ']' || character == '}')) {
      --depth;
    }
  }
  return deepest;
}

}  // namespace

nlohmann::json parse_json_text(std::string_view text, const std::string& name) {
  if (nesting_depth(text) > kMaxJsonDepth) {
    throw Error(fmt::format("{} is nested more than {} levels deep", name, kMaxJsonDepth));
  }
  try {
    return nlohmann::json::parse(text.begin(), text.end());
  } catch (const nlohmann::json::exception& failure) {
    throw Error(name + " " + json_problem(failure, text.size()));
  }
}

}  // namespace rebounce

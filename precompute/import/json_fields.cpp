#include "precompute/import/json_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "precompute/import/parsed_json.h"
#include "precompute/import/text_file.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

using nlohmann::json;

/// A number in single precision, infinite beyond its range; NaN for what is none.
float as_float(const json& value) {
  return value.is_number() ? value.get<float>() : std::nanf("");
}

/// What numbers must be, of which one is `bad`: in the range of single precision, or above
/// `lowest`.
std::string wanted(const char* numbers, float lowest, float bad) {
  if (std::isinf(bad)) {
    return fmt::format("{} of at most {:.1e}", numbers, std::numeric_limits<float>::max());
  }
  return lowest == kAnyNumber ? numbers : fmt::format("{}, at least {}", numbers, lowest);
}

}  // namespace

void Field::fail(const std::string& name, const std::string& wanted) const {
  constexpr std::size_t kShownCharacters = 40;
  std::string given;
  if (object.contains(name)) {
    given = object.at(name).dump();
    if (given.size() > kShownCharacters) given = given.substr(0, kShownCharacters) + "...";
    given = "; it is " + given;
  }
  throw Error(fmt::format("{}: \"{}\" must be {}{}", where, name, wanted, given));
}

void Field::check_names(const std::vector<std::string_view>& known) const {
  for (const auto& [name, value] : object.items()) {
    if (std::ranges::find(known, name) == known.end()) {
      throw Error(fmt::format("{}: unknown field \"{}\"; known are {}", where, name,
                              fmt::join(known, ", ")));
    }
  }
}

float Field::number(const std::string& name, float lowest, float fallback) const {
  if (!object.contains(name)) return fallback;
  const float x = as_float(object.at(name));
  if (!std::isfinite(x) || x < lowest) fail(name, wanted("a number", lowest, x));
  return x;
}

float Field::required_length(const std::string& name) const {
  if (!object.contains(name)) fail(name, "given, in metres");
  const float length = number(name, 0, 0);
  if (length <= 0) fail(name, "more than 0");
  return length;
}

Float3 Field::triple(const std::string& name, float lowest, const Float3& fallback) const {
  if (!object.contains(name)) return fallback;
  const json& value = object.at(name);
  Float3 result{};
  if (!value.is_array() || value.size() != 3) fail(name, wanted("three numbers", lowest, 0));
  for (std::size_t k = 0; k < 3; ++k) {
    result[k] = as_float(value[k]);
    if (!std::isfinite(result[k]) || result[k] < lowest) {
      fail(name, wanted("three numbers", lowest, result[k]));
    }
  }
  return result;
}

Float3 Field::vector(const std::string& name, const Float3& fallback) const {
  const Float3 v = triple(name, kAnyNumber, fallback);
  if (v == Float3{0, 0, 0}) fail(name, "a vector that is not zero");
  return v;
}

Float3 Field::unit_vector(const std::string& name, const Float3& fallback) const {
  Float3 v = vector(name, fallback);
  // First by a power of two, which rounds nothing: the squares must be in the range of floats.
  const int exponent = std::ilogb(std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}));
  for (float& x : v) x = std::ldexp(x, -exponent);
  const float size = glm::length(to_glm(v));
  for (float& x : v) x /= size;
  return v;
}

json read_json_object(const std::filesystem::path& path, const std::string& content) {
  json document = parse_json_text(read_text_file(path), path.string());
  if (!document.is_object()) {
    throw Error(path.string() + ": must hold an object with \"" + content + "\"");
  }
  return document;
}

}  // namespace rebounce

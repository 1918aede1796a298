#include "precompute/cli/json_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "rebounce/error.h"

namespace rebounce::cli {
namespace {

using nlohmann::json;

float length(const Float3& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

}  // namespace

void Field::fail(const std::string& name, const std::string& wanted) const {
  throw Error(fmt::format("{}: \"{}\" must be {}", where, name, wanted));
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
  const json& value = object.at(name);
  const auto x = value.is_number() ? value.get<float>() : std::nanf("");
  if (!std::isfinite(x) || x < lowest) fail(name, fmt::format("a number, at least {}", lowest));
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
  bool good = value.is_array() && value.size() == 3;
  for (std::size_t k = 0; good && k < 3; ++k) {
    good = value[k].is_number();
    if (good) result[k] = value[k].get<float>();
    good = good && std::isfinite(result[k]) && result[k] >= lowest;
  }
  if (!good) {
    fail(name, lowest < 0 ? "three numbers" : fmt::format("three numbers, at least {}", lowest));
  }
  return result;
}

Float3 Field::vector(const std::string& name, const Float3& fallback) const {
  const Float3 v = triple(name, kAnyNumber, fallback);
  if (!(length(v) > 1e-20F)) fail(name, "a vector that is not zero");
  return v;
}

Float3 Field::unit_vector(const std::string& name, const Float3& fallback) const {
  Float3 v = vector(name, fallback);
  const float size = length(v);
  for (float& x : v) x /= size;
  return v;
}

json read_json_object(const std::filesystem::path& path, const std::string& content) {
  std::ifstream stream(path);
  if (!stream) throw Error("cannot open " + path.string() + "; check the name");
  json document;
  try {
    document = json::parse(stream);
  } catch (const json::exception& error) {
    throw Error(path.string() + " is not JSON: " + error.what());
  }
  if (!document.is_object()) {
    throw Error(path.string() + ": must hold an object with \"" + content + "\"");
  }
  return document;
}

}  // namespace rebounce::cli

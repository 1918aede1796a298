#pragma once

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce::cli {

inline constexpr float kAnyNumber = std::numeric_limits<float>::lowest();

/// One JSON object and where it stands, for messages. What is wrong with a field is an Error that
/// names place and field; fields that are absent have a fallback.
struct Field {
  const nlohmann::json& object;
  std::string where;

  [[noreturn]] void fail(const std::string& name, const std::string& wanted) const;

  /// Refuses fields that are not `known`.
  void check_names(const std::vector<std::string_view>& known) const;

  float number(const std::string& name, float lowest, float fallback) const;
  float required_length(const std::string& name) const;  ///< metres, more than 0
  Float3 triple(const std::string& name, float lowest, const Float3& fallback) const;

  /// Three numbers of any length but 0, as they are or made a unit vector.
  Float3 vector(const std::string& name, const Float3& fallback) const;
  Float3 unit_vector(const std::string& name, const Float3& fallback) const;
};

/// Parses a file that must hold a JSON object with `content` in it, which is for the message alone.
nlohmann::json read_json_object(const std::filesystem::path& path, const std::string& content);

}  // namespace rebounce::cli

#pragma once

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

inline constexpr float kAnyNumber = std::numeric_limits<float>::lowest();

/// One JSON object and its place, for messages. A wrong field throws Error that names place and
/// field; a missing field gives the fallback.
struct Field {
  const nlohmann::json& object;
  std::string where;

  [[noreturn]] void fail(const std::string& name, const std::string& wanted) const;

  /// Throws Error for a field that is not `known`.
  void check_names(const std::vector<std::string_view>& known) const;

  float number(const std::string& name, float lowest, float fallback) const;
  float required_length(const std::string& name) const;  ///< metres, above 0
  Float3 triple(const std::string& name, float lowest, const Float3& fallback) const;

  /// Three numbers, as they are or scaled to a unit vector; the length must not be 0.
  Float3 vector(const std::string& name, const Float3& fallback) const;
  Float3 unit_vector(const std::string& name, const Float3& fallback) const;
};

/// Parses a file that must hold a JSON object. `content` describes it in messages.
nlohmann::json read_json_object(const std::filesystem::path& path, const std::string& content);

}  // namespace rebounce

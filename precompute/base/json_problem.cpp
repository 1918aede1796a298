#include "precompute/base/json_problem.h"

namespace rebounce {

std::string json_problem(const nlohmann::json::exception& failure, std::size_t size) {
  const auto* const place = dynamic_cast<const nlohmann::json::parse_error*>(&failure);
  if (place != nullptr && place->byte > size) {
    return "is truncated: it ends at byte " + std::to_string(size) +
           ", in the middle of its JSON; get a complete copy";
  }
  // "[json.exception.NAME] " is for programmers.
  const std::string text = failure.what();
  const std::size_t mark = text.find("] ");
  return "is not JSON: " + (mark == std::string::npos ? text : text.substr(mark + 2));
}

}  // namespace rebounce

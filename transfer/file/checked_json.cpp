#include "transfer/file/checked_json.h"

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "rebounce/error.h"

namespace rebounce {
namespace {

using nlohmann::json;

/// Checks the depth of a parse and the keys of each open object.
class Watch {
 public:
  explicit Watch(std::size_t max_depth) : max_depth_(max_depth) {}

  bool operator()(int /*depth*/, json::parse_event_t event, json& value) {
    switch (event) {
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        if (keys_.size() == max_depth_) {
          throw Error("JSON nested more than " + std::to_string(max_depth_) + " deep");
        }
        keys_.emplace_back();
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end:
        keys_.pop_back();
        break;
      case json::parse_event_t::key:
        if (!keys_.back().insert(value.get_ref<const std::string&>()).second) {
          throw Error("the key " + value.dump() + " appears twice");
        }
        break;
      case json::parse_event_t::value:
        break;
    }
    return true;
  }

 private:
  std::size_t max_depth_;
  std::vector<std::set<std::string>> keys_;
};

}  // namespace

json parse_untrusted_json(std::string_view text, std::size_t max_depth) {
  Watch watch(max_depth);
  try {
    return json::parse(text.begin(), text.end(), std::ref(watch));
  } catch (const json::parse_error& error) {
    throw Error("not valid JSON at byte " + std::to_string(error.byte));
  } catch (const json::exception&) {
    throw Error("JSON with a number that is out of range");
  }
}

}  // namespace rebounce

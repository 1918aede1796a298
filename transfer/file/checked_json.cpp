#include "transfer/file/checked_json.h"

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "rebounce/error.h"

namespace rebounce {
namespace {

using nlohmann::json;

// At the end of an object the parser looks at all entries of what the object is in. So many take
// some tenths of a second.
constexpr std::size_t kMostLooks = std::size_t{1} << 26U;

/// Checks the depth of a parse, the keys of each open object, and the work of the parser.
class Watch {
 public:
  explicit Watch(std::size_t max_depth) : max_depth_(max_depth) {}

  bool operator()(int /*depth*/, json::parse_event_t event, json& value) {
    switch (event) {
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        if (open_.size() == max_depth_) {
          throw Error("JSON nested more than " + std::to_string(max_depth_) + " deep");
        }
        count_entry();
        open_.emplace_back();
        break;
      case json::parse_event_t::object_end:
        open_.pop_back();
        if (!open_.empty()) looks_ += open_.back().entry_count;
        if (looks_ > kMostLooks) throw Error("JSON with too many objects side by side");
        break;
      case json::parse_event_t::array_end:
        open_.pop_back();
        break;
      case json::parse_event_t::key:
        if (!open_.back().keys.insert(value.get_ref<const std::string&>()).second) {
          throw Error("the key " + value.dump() + " appears twice");
        }
        break;
      case json::parse_event_t::value:
        count_entry();
        break;
    }
    return true;
  }

 private:
  /// An object or array that has not ended.
  struct Open {
    std::set<std::string> keys;
    std::size_t entry_count = 0;
  };

  void count_entry() {
    if (!open_.empty()) ++open_.back().entry_count;
  }

  std::size_t max_depth_;
  std::size_t looks_ = 0;
  std::vector<Open> open_;
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

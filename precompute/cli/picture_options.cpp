#include "precompute/cli/picture_options.h"
#include "runtime/frame/engine_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <numbers>
#include <string_view>
#include <vector>

#include "rebounce/error.h"
#include "runtime/demo/picture/camera.h"

namespace rebounce::cli {
namespace {

constexpr int kLargestSide = 16384;  // pixels

struct NamedShow {
  std::string_view name;
  Show show;
};
constexpr std::array<NamedShow, 5> kShows = {{{"direct", Show::kDirect},
                                              {"indirect", Show::kIndirect},
                                              {"radiosity", Show::kRadiosity},
                                              {"patches", Show::kPatches},
                                              {"error", Show::kError}}};

std::vector<float> parse_numbers(const std::string& text) {
  std::vector<float> numbers;
  for (const char* at = text.data(); at <= text.data() + text.size();) {
    float value = 0;
    const auto [end, error] = std::from_chars(at, text.data() + text.size(), value);
    const bool at_end = end == text.data() + text.size();
    if (error != std::errc() || (!at_end && *end != ',')) return {};
    numbers.push_back(value);
    if (at_end) return numbers;
    at = end + 1;
  }
  return {};
}

}  // namespace

Camera choose_camera(const std::string& wanted, const Engine& engine) {
  const TransferData& data = engine.data();
  if (wanted.empty()) {
    return data.cameras.empty() ? fit_camera(data, *engine.parts().tracer, engine.radiosity())
                                : data.cameras.front();
  }
  for (const Camera& camera : data.cameras) {
    if (camera.name == wanted) return camera;
  }
  const std::vector<float> n = parse_numbers(wanted);
  if (n.size() == 1 && n[0] >= 0 && n[0] < static_cast<float>(data.cameras.size())) {
    return data.cameras[static_cast<std::size_t>(n[0])];
  }
  if (n.size() == 6 || n.size() == 7) {
    constexpr float kDegree = std::numbers::pi_v<float> / 180;
    return look_at({n[0], n[1], n[2]}, {n[3], n[4], n[5]}, (n.size() == 7 ? n[6] : 50) * kDegree);
  }
  throw Error(fmt::format("no camera \"{}\": the file has {}; or give px,py,pz,tx,ty,tz[,degrees]",
                          wanted, data.cameras.size()));
}

std::pair<int, int> parse_size(const std::string& text) {
  const std::size_t cross = text.find('x');
  int width = 0, height = 0;
  if (cross != std::string::npos) {
    const char* end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), text.data() + cross, width);
    const auto second = std::from_chars(text.data() + cross + 1, end, height);
    const bool whole = first.ptr == text.data() + cross && second.ptr == end;
    if (whole && width >= 1 && height >= 1 && width <= kLargestSide && height <= kLargestSide) {
      return {width, height};
    }
  }
  throw Error(
      fmt::format("size \"{}\" must be WIDTHxHEIGHT with sides from 1 to {}", text, kLargestSide));
}

std::vector<std::string> show_names() {
  std::vector<std::string> names;
  for (const NamedShow& named : kShows) names.emplace_back(named.name);
  return names;
}

Show parse_show(const std::string& name) {
  return std::ranges::find(kShows, name, &NamedShow::name)->show;
}

}  // namespace rebounce::cli

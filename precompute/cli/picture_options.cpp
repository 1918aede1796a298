#include "precompute/cli/picture_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "rebounce/error.h"
#include "runtime/demo/picture/camera.h"
#include "runtime/demo/picture/default_view.h"

namespace rebounce::cli {
namespace {

constexpr int kLargestSide = 16384;  // pixels
constexpr float kDegree = std::numbers::pi_v<float> / 180;

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

Camera named_camera(const TransferData& data, std::size_t number) {
  Camera camera = data.cameras[number];
  if (camera.name.empty()) camera.name = std::to_string(number);
  return camera;
}

std::string camera_names(const TransferData& data) {
  std::string names;
  for (std::size_t k = 0; k < data.cameras.size(); ++k) {
    names += fmt::format("{}\"{}\"", k > 0 ? ", " : "", named_camera(data, k).name);
  }
  return names;
}

}  // namespace

ChosenCamera choose_camera(const std::string& wanted, const TransferData& data,
                           const RayTracer& tracer) {
  const std::size_t count = data.cameras.size();
  if (wanted.empty() && count == 0) return {default_view(data.mesh, tracer), CameraSource::kFound};
  if (wanted.empty()) return {named_camera(data, 0), CameraSource::kScene};
  for (const Camera& camera : data.cameras) {
    if (camera.name == wanted) return {camera, CameraSource::kScene};
  }
  const std::vector<float> n = parse_numbers(wanted);
  if (n.size() == 1 && n[0] >= 0 && n[0] < static_cast<float>(count) && n[0] == std::floor(n[0])) {
    return {named_camera(data, static_cast<std::size_t>(n[0])), CameraSource::kScene};
  }
  if (n.size() == 6 || n.size() == 7) {
    const float degrees = n.size() == 7 ? n[6] : 50;
    return {look_at({n[0], n[1], n[2]}, {n[3], n[4], n[5]}, degrees * kDegree),
            CameraSource::kNumbers};
  }
  throw Error(
      fmt::format("no camera \"{}\": the scene has {}; give one it has, or "
                  "px,py,pz,tx,ty,tz[,degrees]",
                  wanted, count == 0 ? "none" : camera_names(data)));
}

std::string as_option(const Camera& camera) {
  const auto& p = camera.position;
  const auto& b = camera.backward;
  return fmt::format("{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.4g}", p[0], p[1], p[2],
                     p[0] - b[0], p[1] - b[1], p[2] - b[2], camera.vertical_fov / kDegree);
}

std::string described(const ChosenCamera& chosen) {
  switch (chosen.source) {
    case CameraSource::kScene:
      return fmt::format("camera \"{}\" of the scene", chosen.camera.name);
    case CameraSource::kFound:
      return fmt::format("the scene has no camera, so from where it shows most: --camera {}",
                         as_option(chosen.camera));
    case CameraSource::kNumbers:
      break;
  }
  return "--camera " + as_option(chosen.camera);
}

nlohmann::json as_json(const ChosenCamera& chosen) {
  constexpr std::array kSources = {"scene", "geometry", "numbers"};
  const Camera& camera = chosen.camera;
  const auto& b = camera.backward;
  return {{"source", kSources[static_cast<std::size_t>(chosen.source)]},
          {"name", camera.name},
          {"position", camera.position},
          {"direction", Float3{-b[0], -b[1], -b[2]}},
          {"degrees", camera.vertical_fov / kDegree}};
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

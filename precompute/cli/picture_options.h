#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "rebounce/scene_data.h"
#include "runtime/demo/picture/picture.h"

namespace rebounce::cli {

/// What --camera means, for `--help`.
inline constexpr const char* kCameraHelp =
    "Name or number of a camera of the scene, or px,py,pz,tx,ty,tz[,degrees] in metres; by default "
    "the first camera of the scene or, if it has none, the view at eye height inside of it, or "
    "from "
    "around it, that shows most of it, whatever lights it";

/// Who said where a camera is.
enum class CameraSource : std::uint8_t {
  kScene,    ///< the scene has it
  kFound,    ///< default_view()
  kNumbers,  ///< the user
};

struct ChosenCamera {
  Camera camera;  ///< without a name in the scene it is called by its number
  CameraSource source = CameraSource::kScene;
};

/// The camera that `wanted` describes: the name or number of a camera of the scene, or
/// px,py,pz,tx,ty,tz[,degrees]. If it is empty: the first camera of the scene, or default_view().
/// Throws Error that names the cameras of the scene if there is no such camera.
ChosenCamera choose_camera(const std::string& wanted, const TransferData& data,
                           const RayTracer& tracer);

/// The camera in words, and for --json.
std::string described(const ChosenCamera& chosen);
nlohmann::json as_json(const ChosenCamera& chosen);

/// Width and height in pixels from "WIDTHxHEIGHT". Throws Error for any other text.
std::pair<int, int> parse_size(const std::string& text);

/// The names that --show accepts, and their meaning. parse_show expects one of the names.
std::vector<std::string> show_names();
Show parse_show(const std::string& name);

}  // namespace rebounce::cli

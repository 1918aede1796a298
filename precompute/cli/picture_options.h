#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/scene_data.h"
#include "runtime/demo/picture/picture.h"

namespace rebounce::cli {

/// The camera that `wanted` describes: the name or number of a camera of the scene, or
/// px,py,pz,tx,ty,tz[,degrees]. If it is empty: the first camera of the scene, or one fitted to the
/// scene that `engine` has lit. Throws Error if there is no such camera.
Camera choose_camera(const std::string& wanted, const Engine& engine);

/// Width and height in pixels from "WIDTHxHEIGHT". Throws Error for any other text.
std::pair<int, int> parse_size(const std::string& text);

/// The names that --show accepts, and their meaning. parse_show expects one of the names.
std::vector<std::string> show_names();
Show parse_show(const std::string& name);

}  // namespace rebounce::cli

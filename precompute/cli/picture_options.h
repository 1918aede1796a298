#pragma once

#include <string>
#include <utility>
#include <vector>

#include "runtime/demo/picture/picture.h"
#include "runtime/frame/engine.h"
#include "transfer/data/scene_description.h"

namespace rebounce::cli {

/// The camera that `wanted` names: a name or number of one of the scene's, or
/// px,py,pz,tx,ty,tz[,degrees]. If it is empty: the scene's first, or one fitted to what `engine`
/// has lit. Throws Error if there is no such camera.
Camera choose_camera(const std::string& wanted, const Engine& engine);

/// Width and height in pixels from "WIDTHxHEIGHT". Throws Error if it is anything else.
std::pair<int, int> parse_size(const std::string& text);

/// What --show takes, and what it means. parse_show wants one of the names.
std::vector<std::string> show_names();
Show parse_show(const std::string& name);

}  // namespace rebounce::cli

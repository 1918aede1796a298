#pragma once

#include <span>
#include <string>
#include <vector>

#include "rebounce/engine.h"

namespace rebounce {

/// A line for each of `lights` whose light arrives at no patch of the scene of `engine`, or whose
/// middle lies inside of a wall, a floor or another body, with its number and name. Lights that are
/// switched off have none. Leaves the engine as it is. Throws Error as Engine::relight does.
std::vector<std::string> lamp_warnings(const Engine& engine, std::span<const Light> lights);

}  // namespace rebounce

#pragma once

#include <filesystem>
#include <vector>

#include "runtime/demo/viewer/window/viewer_setup.h"

namespace rebounce::cli {

/// Reads how lamps move (notes/viewer.md) into the motions of `lights`, which are counted from 0,
/// and adds the spheres that the file has to `spheres`. Returns the frames per second, 30 if the
/// file does not say. Throws Error naming the file, the motion or sphere and the field that is
/// wrong.
float read_light_path(const std::filesystem::path& path, std::vector<ViewerLight>& lights,
                      std::vector<ViewerSphere>& spheres);

}  // namespace rebounce::cli

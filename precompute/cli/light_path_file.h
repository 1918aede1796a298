#pragma once

#include <filesystem>
#include <vector>

#include "runtime/demo/viewer/window/viewer_setup.h"

namespace rebounce::cli {

/// Reads the motions of lamps (notes/reference/light_path_file.md) into `lights`, which are
/// numbered from 0, and adds the spheres of the file to `spheres`. Returns the frames per second,
/// 30 by default. Throws Error naming the file, the motion or sphere and the field that is wrong.
float read_light_path(const std::filesystem::path& path, std::vector<ViewerLight>& lights,
                      std::vector<ViewerSphere>& spheres);

}  // namespace rebounce::cli

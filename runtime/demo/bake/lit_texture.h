#pragma once

#include <cstdint>
#include <span>

#include "runtime/demo/bake/lit_surface.h"
#include "runtime/demo/image/image_file.h"

namespace rebounce {

/// The screen colour, with `exposure` stops, of the display triangles with `chosen` [t] not 0, at
/// the texels of data.lightmap: base colour, light and emission. Other texels are black. `added`
/// [texels] is that of added_at_texels. Gives the same bits for any number of OpenMP threads.
ScreenImage light_texture(const TransferData& data, const SurfaceLighter& lighter,
                          std::span<const Float3> added, std::span<const std::uint8_t> chosen,
                          float exposure);

}  // namespace rebounce

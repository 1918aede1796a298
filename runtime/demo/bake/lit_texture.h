#pragma once

#include <cstdint>
#include <span>

#include "runtime/demo/bake/lit_surface.h"
#include "runtime/demo/image/image_file.h"

namespace rebounce {

/// What leaves the display triangles that are `chosen` [t] not to be 0, at the texels of
/// data.lightmap: base colour, light and emission, as a screen shows it with `exposure` stops.
/// Texels of others are black. The same bits for any number of OpenMP threads.
ScreenImage light_texture(const TransferData& data, const SurfaceLighter& lighter,
                          std::span<const std::uint8_t> chosen, float exposure);

}  // namespace rebounce

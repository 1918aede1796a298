#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "runtime/demo/bake/lit_mesh.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Encodes a lit mesh as binary glTF 2.0 with KHR_materials_unlit. It has one primitive for each
/// material, with COLOR_0 as normalised 16-bit numbers; the base colour textures of `data`, or the
/// mesh's own; the cameras of `data`; and `lights` as KHR_lights_punctual, which do not affect
/// unlit materials. The exposure is in asset.extras. Throws Error if the file would be 4 GiB or
/// more, or if a texture is neither PNG nor JPEG.
std::vector<std::byte> encode_glb(const LitMesh& mesh, const TransferData& data,
                                  std::span<const Light> lights);

/// Writes a lit mesh as binary glTF, completely or not at all (AtomicFile). Returns the size of the
/// file in bytes. Throws Error if the folder is missing, not writable or full, or as encode_glb
/// does.
std::size_t write_glb(const std::filesystem::path& path, const LitMesh& mesh,
                      const TransferData& data, std::span<const Light> lights);

}  // namespace rebounce

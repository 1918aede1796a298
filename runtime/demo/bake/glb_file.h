#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "runtime/demo/bake/lit_mesh.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Encodes a lit mesh as binary glTF 2.0: one primitive for each material, with COLOR_0 as
/// normalised 16-bit numbers, KHR_materials_unlit, and the base colour textures of `data` or the
/// mesh's own; its cameras, and `lights` as KHR_lights_punctual (unlit materials do not take light
/// from them). The exposure is in asset.extras. Throws Error if it would be 4 GiB or more, or a
/// texture is neither PNG nor JPEG.
std::vector<std::byte> encode_glb(const LitMesh& mesh, const TransferData& data,
                                  std::span<const Light> lights);

/// Writes it whole or not at all (see AtomicFile). Throws Error if the folder is missing, not
/// writable or full, or as encode_glb does. Returns the size of the file in bytes.
std::size_t write_glb(const std::filesystem::path& path, const LitMesh& mesh,
                      const TransferData& data, std::span<const Light> lights);

}  // namespace rebounce

#pragma once

// What a page fetches: transfer files without what it does not show, packed.

#include <cstdint>
#include <filesystem>

#include "transfer/file/transfer_data.h"

namespace rebounce::cli {

/// Where the form factors of a page's file go: beside it, NAME.form_factors.safetensors for
/// NAME.safetensors.
std::filesystem::path form_factor_file_beside(const std::filesystem::path& path);

/// Writes to `path`, packed with gzip, what runtime/web reads of `data`: no links, pairs, lightmap
/// or surface harmonics, and weights of 12 bits. Compressed form factors, where there are any, go
/// to form_factor_file_beside(path); where there are none, an older such file is removed, which
/// belongs to the file that is replaced. Returns the bytes of both. Throws Error if a file cannot
/// be written; older files stay then.
std::uint64_t save_web_files(const std::filesystem::path& path, TransferData data);

}  // namespace rebounce::cli

#pragma once

#include <cstddef>
#include <filesystem>

#include "transfer/base/shared_array.h"

namespace rebounce {

/// Maps a file into memory, read-only; the array keeps the mapping alive. Throws Error when `path`
/// is missing, unreadable or not a regular file.
///
/// The one place that knows how: a platform without mmap reads the file into a vector here. A file
/// must not be cut short while it is mapped; AtomicFile replaces files and never does that.
SharedArray<std::byte> map_file(const std::filesystem::path& path);

}  // namespace rebounce

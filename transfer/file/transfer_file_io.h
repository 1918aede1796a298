#pragma once

// The transfer file: a safetensors container; notes/reference/file_format.md documents every
// tensor.

#include <filesystem>
#include <memory>

#include "transfer/file/safetensors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Raised whenever a file of the previous version can no longer be read or means something else.
inline constexpr int kFileFormatVersion = 8;

/// Writes `data` whole or not at all: into a temporary file beside `path`, flushed to disk and then
/// renamed over it. Throws Error when the folder is missing, not writable or full.
void save_transfer_file(const std::filesystem::path& path, const TransferData& data);

/// Gives the bytes of that file to `sink`.
void write_transfer_file(const ByteSink& sink, const TransferData& data);

/// Loads a transfer file, mapping the operator and the form factors instead of copying them.
/// Verifies version, checksum, the size and range of every tensor before anything is used; throws
/// Error with the reason when the file is not one, is damaged, or is of another version.
TransferData load_transfer_file(const std::filesystem::path& path);

/// Reads a transfer file likewise; the operator and the form factors stay parts of its memory.
TransferData read_transfer_file(const SafetensorsFile& file);

/// Writes the compressed form factors of `data` alone, for those who have the rest, as
/// save_transfer_file does. Throws Error if there are none.
void save_form_factor_file(const std::filesystem::path& path, const TransferData& data);

/// Gives the bytes of that file to `sink`.
void write_form_factor_file(const ByteSink& sink, const TransferData& data);

/// Reads what save_form_factor_file wrote. Throws Error as read_transfer_file does, and if it was
/// not written with `data`.
std::shared_ptr<const HierarchicalOperator> read_form_factor_file(const SafetensorsFile& file,
                                                                  const TransferData& data);

}  // namespace rebounce

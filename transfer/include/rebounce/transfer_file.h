#pragma once

// Transfer files, and what is in one. notes/reference/file_format.md documents them.

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "rebounce/operators.h"
#include "rebounce/scene_data.h"

namespace rebounce {

/// All that a transfer file holds: the scene, form factors and the operator. Immutable, and shared
/// by any number of engines, solvers and threads.
struct TransferData;

/// Loads a transfer file. The operator and the form factors are mapped into memory instead of
/// copied: the file must not change while they are in use. Throws Error with the reason if the file
/// is none, is damaged (version, checksum, the size and range of every tensor), or is of another
/// version.
std::shared_ptr<const TransferData> load_transfer(const std::filesystem::path& path);

/// Reads a transfer file from memory, where it stays while the operator and the form factors are in
/// use; `name` stands for it in messages. Throws Error as load_transfer does.
std::shared_ptr<const TransferData> read_transfer(std::vector<std::byte> bytes,
                                                  const std::string& name);

/// Writes `data` whole or not at all: into a temporary file beside `path`, flushed to disk and then
/// renamed over it. Throws Error if there is no operator, or the folder is missing, not writable or
/// full.
void save_transfer(const std::filesystem::path& path, const TransferData& data);

/// The scene of `data`; lives as long as they do.
const SceneData& scene_data(const TransferData& data);

/// What is known of the operator of a transfer file.
struct OperatorInfo {
  OperatorKind kind = OperatorKind::kNoOperator;  ///< kNoOperator: there is none
  std::size_t bytes = 0;                          ///< all three channels
  std::size_t bytes_per_apply = 0;                ///< that one product with it reads
};
OperatorInfo operator_info(const TransferData& data);

/// Which patches the operator brings light to, and which it takes light from; lives as long as
/// `data`. Throws Error if there is no operator.
const PatchRoles& patch_roles(const TransferData& data);

}  // namespace rebounce

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "precompute/compression/block_tree.h"

namespace rebounce {

/// Keeps parts of an operator in a folder, one file each, until the operator is complete.
///
/// A file is written whole or not at all. It begins with a hash of its name and of the `key` that
/// it was made for, and a hash of its content. A part that was made for another key, has another
/// name, is damaged or is no such file counts as missing. Rank 0 reads, and gives the others what
/// it has found.
class BlockCheckpoint {
 public:
  /// Keeps nothing.
  BlockCheckpoint() = default;

  /// Makes the folder if it does not exist; an empty path keeps nothing. `key` is a hash of all
  /// that the parts depend on. Throws Error if the path exists and is no folder, or the folder
  /// cannot be made.
  BlockCheckpoint(std::filesystem::path folder, std::string key);

  bool keeps() const { return !folder_.empty(); }

  /// Writes the part called `name`, which is also the name of its file. Throws Error if it cannot
  /// be written.
  void keep(const std::string& name, const BlockPart& part) const;

  /// The part called `name`, if it is there. All ranks call it.
  std::optional<BlockPart> find(const std::string& name) const;

  /// The part called `name` if it is there; otherwise makes it with `make`, and rank 0 keeps it.
  /// All ranks call it.
  template <typename Make>
  BlockPart find_or_make(const std::string& name, const Make& make) const {
    if (std::optional<BlockPart> found = find(name)) return std::move(*found);
    BlockPart part = make();
    if (Ranks().rank() == 0) keep(name, part);
    return part;
  }

 private:
  std::optional<BlockPart> read(const std::string& name) const;

  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace rebounce

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "precompute/compression/block_tree.h"

namespace rebounce {

/// Parts of an operator that are kept in a folder, a file each, until the whole is there.
///
/// A file is there whole or not at all, and begins with a hash of its name and of the `key` that it
/// was made for, and one of what follows: what was made for another key, is another part under this
/// name, is damaged or is no such file counts as not there.
class BlockCheckpoint {
 public:
  /// Keeps nothing.
  BlockCheckpoint() = default;

  /// Makes the folder if need be; an empty path keeps nothing. `key`: a hash of all that the parts
  /// depend on. Throws Error if there is something else under its name, or it cannot be made.
  BlockCheckpoint(std::filesystem::path folder, std::string key);

  bool keeps() const { return !folder_.empty(); }

  /// Writes the part that is called `name`, also the name of its file. Throws Error if it cannot.
  void keep(const std::string& name, const BlockPart& part) const;

  /// That part, if it is there.
  std::optional<BlockPart> find(const std::string& name) const;

  /// That part, or if it is not there what `make` makes of it, which is then kept.
  template <typename Make>
  BlockPart find_or_make(const std::string& name, const Make& make) const {
    if (std::optional<BlockPart> found = find(name)) return std::move(*found);
    BlockPart part = make();
    keep(name, part);
    return part;
  }

 private:
  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace rebounce

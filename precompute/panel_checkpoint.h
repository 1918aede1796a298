#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "block_tree.h"

namespace rebounce {

/// Parts of an operator that are kept in a folder, a file each, until the whole is there.
///
/// A file is there whole or not at all, and begins with the `key` that it was made for and a hash
/// of what follows: what was made for another key, is damaged or is no such file counts as not
/// there.
class PanelCheckpoint {
 public:
  /// Makes the folder if need be; an empty path keeps nothing. `key`: a hash of all that the parts
  /// depend on. Throws Error if there is something else under its name, or it cannot be made.
  PanelCheckpoint(std::filesystem::path folder, std::string key);

  /// Writes part number `panel`. Throws Error if it cannot.
  void keep(std::size_t panel, const BlockPart& part) const;

  /// That part, if it is there.
  std::optional<BlockPart> find(std::size_t panel) const;

 private:
  std::filesystem::path file(std::size_t panel) const;

  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace rebounce

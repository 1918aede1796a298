#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "precompute/base/checkpoint.h"
#include "precompute/compression/block_tree.h"

namespace rebounce {

/// A checkpoint (Checkpoint) whose parts are those of an operator.
class BlockCheckpoint {
 public:
  /// Keeps nothing.
  BlockCheckpoint() = default;

  /// As for Checkpoint.
  BlockCheckpoint(std::filesystem::path folder, std::string key)
      : parts_(std::move(folder), std::move(key)) {}

  bool keeps() const { return parts_.keeps(); }

  /// Writes the part called `name`, without its cost. Throws Error if it cannot be written.
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
  Checkpoint parts_;
};

}  // namespace rebounce

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// Which patches an operator brings light to, its receivers, and which it takes light from, its
/// sources. A patch may be both, or neither: it reflects light on its way from one to the other
/// all the same.
struct PatchRoles {
  static constexpr std::uint8_t kReceiver = 1, kSource = 2, kBoth = kReceiver | kSource;

  std::vector<std::uint8_t> role;  ///< [n] of these bits; empty: every patch is both

  bool all_are_both() const { return role.empty(); }
  bool is_receiver(std::size_t patch) const { return has(patch, kReceiver); }
  bool is_source(std::size_t patch) const { return has(patch, kSource); }
  bool has(std::size_t patch, std::uint8_t bit) const {
    return role.empty() || (role[patch] & bit) != 0;
  }

  /// How many of `patch_count` patches have `bit`.
  std::size_t count(std::uint8_t bit, std::size_t patch_count) const;

  /// Sets the light [n] of patches without `bit` to 0.
  void keep(std::uint8_t bit, std::span<Float3> light) const;

  bool operator==(const PatchRoles&) const = default;
};

/// Throws Error unless there is a role for each of `patch_count` patches, or none at all, all are
/// of the bits above, and there are a receiver and a source.
void check_roles(const PatchRoles& roles, std::size_t patch_count);

}  // namespace rebounce

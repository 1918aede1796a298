#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "precompute/base/ranks.h"

namespace rebounce {

/// Keeps finished parts of a build in a folder, one file each, until the build is complete. A part
/// is some arrays.
///
/// A file is written whole or not at all. It begins with a hash of its name and of the `key` that
/// it was made for, and a hash of its content. A part that was made for another key, has another
/// name, is damaged or is no such file counts as missing. Rank 0 reads, and gives the others what
/// it has found.
class Checkpoint {
 public:
  /// Keeps nothing.
  Checkpoint() = default;

  /// Makes the folder if it does not exist; an empty path keeps nothing. `key` is a hash of all
  /// that the parts depend on. Throws Error if the path exists and is no folder, the folder cannot
  /// be made, or rank 0 cannot write to it.
  Checkpoint(std::filesystem::path folder, std::string key);

  bool keeps() const { return !folder_.empty(); }

  /// Writes the part called `name`, which is also the name of its file. Throws Error if it cannot
  /// be written.
  template <typename... T>
  void keep(const std::string& name, const std::vector<T>&... arrays) const {
    if (keeps()) write(name, std::vector{std::as_bytes(std::span(arrays))...});
  }

  /// Reads the part called `name`. If it is not there, returns false, and the arrays are empty. All
  /// ranks call it.
  template <typename... T>
  bool find(const std::string& name, std::vector<T>&... arrays) const {
    const Ranks ranks;
    std::uint8_t found = 0;
    if (keeps() && ranks.rank() == 0) found = read(name, {target(arrays)...}) ? 1 : 0;
    if (keeps()) ranks.share(std::span(&found, 1));
    if (found == 0) {
      (arrays.clear(), ...);
    } else {
      (ranks.share(std::span(&arrays, 1)), ...);
    }
    return found != 0;
  }

 private:
  /// An array to read: `resize` gives it so many items, and returns their place.
  struct Target {
    std::size_t item_bytes;
    std::function<std::span<std::byte>(std::size_t count)> resize;
  };

  template <typename T>
  static Target target(std::vector<T>& array) {
    static_assert(std::is_trivially_copyable_v<T>);
    return {sizeof(T), [&array](std::size_t count) {
              array.resize(count);
              return std::as_writable_bytes(std::span(array));
            }};
  }

  void write(const std::string& name, const std::vector<std::span<const std::byte>>& arrays) const;
  bool read(const std::string& name, const std::vector<Target>& targets) const;

  std::filesystem::path folder_;
  std::string key_;
};

}  // namespace rebounce

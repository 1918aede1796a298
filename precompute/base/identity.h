#pragma once

#include <cstddef>
#include <cstdint>
#include <ranges>
#include <span>
#include <string>
#include <string_view>

#include "rebounce/version.h"
#include "transfer/file/content_hash.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce {

/// A hash of all that a result depends on, the versions of program and file format among it.
class Identity {
 public:
  Identity() { add(std::string_view(version()), std::span(&kFileFormatVersion, 1)); }

  /// Adds the items of each range, and how many they are.
  template <std::ranges::contiguous_range... Range>
  void add(const Range&... ranges) {
    (add_items(std::as_bytes(std::span(ranges)), std::ranges::size(ranges)), ...);
  }

  std::string text() const { return hash_.text(); }

 private:
  void add_items(std::span<const std::byte> bytes, std::uint64_t count) {
    hash_.update(std::as_bytes(std::span(&count, 1)));
    hash_.update(bytes);
  }

  ContentHash hash_;
};

}  // namespace rebounce

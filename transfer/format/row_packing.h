#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace rebounce {

/// Packs the rows of coupling matrices, one after the other (RowFormat).
class RowPacking {
 public:
  /// Appends a row. Its integers have a step near `step`, or a larger one that 16 bits can hold; 0:
  /// the finest that 16 bits can hold. Throws Error if an entry is too large.
  void append(std::span<const float> entries, double step);

  std::vector<std::uint8_t> formats() const { return formats_; }

  /// The bytes of all rows with the padding of their array.
  std::vector<std::uint8_t> release_bytes();

 private:
  std::vector<std::uint8_t> formats_, bytes_;
};

}  // namespace rebounce

#pragma once

// Vector4::PackedLanes with the vector extension alone; vector_portable.h includes this.

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "transfer/format/row_format.h"
#include "transfer/kernels/vector_portable.h"

namespace rebounce {
namespace {

class Vector4::PackedLanes {
 public:
  explicit PackedLanes(const ChannelLanes& lanes) : lanes_(lanes) {}

  /// A row in one format.
  class Row {
   public:
    Row(const PackedLanes& lanes, RowFormat format) : lanes_(lanes.lanes_), format_(format) {}
    /// Loads the column of a vector; reads 8 bytes.
    Vector4 load(const std::uint8_t* row, std::size_t vector) const {
      const std::size_t first = vector * lanes_.matrix_count * format_.half_bytes();
      std::uint64_t bits = 0;
      std::memcpy(&bits, row + first / 2, sizeof bits);
      bits >>= first % 2 * 4;
      Integers high;
      for (std::size_t k = 0; k < kWidth; ++k) {
        high[k] = static_cast<std::int32_t>(bits >> (lanes_.value[k] * format_.bits()));
      }
      const int above = 32 - static_cast<int>(format_.bits());
      return {__builtin_convertvector((high << above) >> above, Floats)};
    }
    /// What the loaded entries are multiplied with.
    Vector4 step() const { return broadcast(format_.step()); }

   private:
    const ChannelLanes& lanes_;
    RowFormat format_;
  };

 private:
  const ChannelLanes& lanes_;
};

}  // namespace
}  // namespace rebounce

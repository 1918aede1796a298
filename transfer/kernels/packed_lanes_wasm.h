#pragma once

// Vector4::PackedLanes for WebAssembly; vector_portable.h includes this.

#include <wasm_simd128.h>

#include <bit>
#include <cstddef>
#include <cstdint>

#include "transfer/format/row_format.h"
#include "transfer/kernels/vector_portable.h"

namespace rebounce {
namespace {

/// An entry is the four bytes that begin with it, shifted to the left by a product, and back.
class Vector4::PackedLanes {
  struct Place {
    v128_t bytes, factors;
  };

 public:
  explicit PackedLanes(const ChannelLanes& lanes) : matrix_count_(lanes.matrix_count) {
    for (unsigned width = 0; width < kWidths; ++width) {
      const unsigned bits = 4 * width + 4;
      for (unsigned half = 0; half < 2; ++half) {
        std::uint8_t bytes[16];
        std::uint32_t factors[kWidth];
        for (std::size_t k = 0; k < kWidth; ++k) {
          const unsigned bit = lanes.value[k] * bits + half * 4;
          for (unsigned b = 0; b < 4; ++b) bytes[4 * k + b] = static_cast<std::uint8_t>(bit / 8 + b);
          factors[k] = 1U << (32 - bits - bit % 8);
        }
        places_[width][half] = {wasm_v128_load(bytes), wasm_v128_load(factors)};
      }
    }
  }

  /// A row in one format.
  class Row {
   public:
    Row(const PackedLanes& lanes, RowFormat format)
        : places_(lanes.places_[format.width()]),
          half_bytes_(lanes.matrix_count_ * format.half_bytes()),
          above_(32 - format.bits()),
          step_(format.step()) {}
    /// Loads the column of a vector; reads 8 bytes.
    Vector4 load(const std::uint8_t* row, std::size_t vector) const {
      const std::size_t first = vector * half_bytes_;
      const Place& place = places_[first % 2];
      const v128_t bytes = wasm_i8x16_swizzle(wasm_v128_load64_zero(row + first / 2), place.bytes);
      const v128_t high = wasm_i32x4_mul(bytes, place.factors);
      return {std::bit_cast<Floats>(wasm_f32x4_convert_i32x4(wasm_i32x4_shr(high, above_)))};
    }
    /// What the loaded entries are multiplied with.
    Vector4 step() const { return broadcast(step_); }

   private:
    const Place* places_;
    std::size_t half_bytes_;
    std::uint32_t above_;
    float step_;
  };

 private:
  static constexpr unsigned kWidths = 4;
  /// Of a column that begins with a byte, and of one that begins with the second half of one.
  Place places_[kWidths][2];
  std::size_t matrix_count_;
};

}  // namespace
}  // namespace rebounce

#pragma once

// What reading and writing of safetensors share.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "transfer/file/safetensors.h"

namespace rebounce {

// Tensors are little-endian and used in place.
static_assert(std::endian::native == std::endian::little, "Rebounce needs a little-endian machine");

inline constexpr std::size_t kHeaderLengthSize = sizeof(std::uint64_t);

/// The limit of the reference implementation. It protects against files that would exhaust memory.
inline constexpr std::uint64_t kLargestHeader = 100'000'000;

inline constexpr std::string_view kMetadataKey = "__metadata__";

struct TensorTypeTraits {
  std::string_view name;
  std::size_t size;
};

/// Indexed by TensorType.
inline constexpr std::array<TensorTypeTraits, 13> kTensorTypes{{
    {"BOOL", 1},
    {"U8", 1},
    {"I8", 1},
    {"U16", 2},
    {"I16", 2},
    {"F16", 2},
    {"BF16", 2},
    {"U32", 4},
    {"I32", 4},
    {"F32", 4},
    {"U64", 8},
    {"I64", 8},
    {"F64", 8},
}};

inline const TensorTypeTraits& traits(TensorType type) {
  return kTensorTypes[static_cast<std::size_t>(type)];
}

}  // namespace rebounce

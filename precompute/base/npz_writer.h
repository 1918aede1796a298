#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// kS3 is text of three bytes.
enum class NumpyType : std::uint8_t { kF4, kF8, kU4, kU8, kI4, kI8, kS3 };

/// The NumPy type that stores a C++ type as it is.
template <typename T>
constexpr NumpyType numpy_type() {
  if constexpr (std::same_as<T, float>)
    return NumpyType::kF4;
  else if constexpr (std::same_as<T, double>)
    return NumpyType::kF8;
  else if constexpr (std::same_as<T, std::uint32_t>)
    return NumpyType::kU4;
  else if constexpr (std::same_as<T, std::int64_t>)
    return NumpyType::kI8;
  else {
    static_assert(std::same_as<T, std::uint64_t>, "no NumPy type stores this C++ type");
    return NumpyType::kU8;
  }
}

/// An array to be written. Its bytes are borrowed until the file is written.
struct NumpyArray {
  std::string name;  ///< unique in the file; the key in NumPy
  NumpyType type = NumpyType::kF4;
  std::vector<std::size_t> shape;    ///< outermost dimension first; empty for a single number
  std::span<const std::byte> bytes;  ///< element size x the product of `shape`, row-major
};

/// An array of `values`, row-major in `shape`.
template <typename T>
NumpyArray numpy_array(std::string name, std::vector<std::size_t> shape,
                       std::span<const T> values) {
  return {std::move(name), numpy_type<T>(), std::move(shape), std::as_bytes(values)};
}

/// An array [n, 3] of triples by patch or by vertex.
inline NumpyArray numpy_array(std::string name, std::span<const Float3> values) {
  return {std::move(name), NumpyType::kF4, {values.size(), 3}, std::as_bytes(values)};
}

/// Writes a NumPy .npz file: an uncompressed zip of .npy files (zip64 above 4 GiB). The file is
/// written whole or not at all (see AtomicFile). The arrays are not copied; the same arrays give
/// the same bytes. Throws Error if the file cannot be written, two names are the same, or the bytes
/// of an array do not agree with its shape.
void write_npz(const std::filesystem::path& path, std::span<const NumpyArray> arrays);

}  // namespace rebounce

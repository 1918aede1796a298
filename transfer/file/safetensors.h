#pragma once

// The safetensors container: an 8-byte little-endian header length, a JSON header with the type,
// shape and offsets of each tensor, then the tensors without gaps. It contains no code and can be
// read in place. https://github.com/huggingface/safetensors

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "transfer/base/shared_array.h"

namespace rebounce {

enum class TensorType : std::uint8_t {
  kBool,
  kU8,
  kI8,
  kU16,
  kI16,
  kF16,
  kBF16,
  kU32,
  kI32,
  kF32,
  kU64,
  kI64,
  kF64,
};

/// Bytes of one element.
std::size_t element_size(TensorType type);

/// The tensor type that stores the C++ type `T` unchanged.
template <typename T>
constexpr TensorType tensor_type() {
  if constexpr (std::same_as<T, std::uint8_t>)
    return TensorType::kU8;
  else if constexpr (std::same_as<T, std::uint16_t>)
    return TensorType::kU16;
  else if constexpr (std::same_as<T, std::uint32_t>)
    return TensorType::kU32;
  else if constexpr (std::same_as<T, std::uint64_t>)
    return TensorType::kU64;
  else if constexpr (std::same_as<T, float>)
    return TensorType::kF32;
  else {
    static_assert(std::same_as<T, double>, "no tensor type stores this C++ type");
    return TensorType::kF64;
  }
}

using TensorShape = std::vector<std::uint64_t>;
using SafetensorsMetadata = std::map<std::string, std::string>;

/// A tensor to write. It borrows its bytes until they are written.
struct TensorView {
  std::string name;  ///< unique in the file, and not "__metadata__"
  TensorType type = TensorType::kU8;
  TensorShape shape;                 ///< outermost dimension first
  std::span<const std::byte> bytes;  ///< element_size(type) x the product of `shape`, row-major
};

/// A file that is ready to be written: `prefix`, then the bytes of each tensor in turn.
///
/// The first tensor begins at a multiple of 64 bytes. Tensors are in descending order of the
/// largest power of two, at most 64, that divides their size; equal ones are in order of their
/// names. So each tensor is aligned to this power without gaps, which the format forbids.
struct SafetensorsLayout {
  std::string prefix;  ///< header length and header
  std::vector<TensorView> tensors;
};

/// Plans a file. The same input gives the same bytes. Keys are sorted, and bytes of `metadata` that
/// are not UTF-8 become U+FFFD. Throws Error if two tensors have the same name.
SafetensorsLayout lay_out_safetensors(std::vector<TensorView> tensors,
                                      const SafetensorsMetadata& metadata);

/// Takes the bytes of a file, piece by piece.
using ByteSink = std::function<void(std::span<const std::byte>)>;

/// Gives the bytes of a planned file to `sink`.
void write_safetensors(const ByteSink& sink, const SafetensorsLayout& layout);

/// Writes a planned file completely or not at all (AtomicFile). Throws Error if it cannot.
void write_safetensors(const std::filesystem::path& path, const SafetensorsLayout& layout);

/// Type, shape and offsets of a tensor in a file.
struct TensorInfo {
  TensorType type = TensorType::kU8;
  TensorShape shape;
  std::uint64_t begin = 0;  ///< bytes from the start of the data section
  std::uint64_t end = 0;
};

/// Stands for any size in an expected shape.
inline constexpr std::uint64_t kAnySize = ~std::uint64_t{0};

/// A safetensors file. Everything but the values is checked: the header is complete, at most 100 MB
/// and valid; names are unique, types known, sizes those of the shapes; the tensors fill the data
/// section without gaps, overlaps or remaining bytes.
class SafetensorsFile {
 public:
  /// Maps and checks the file. Throws Error if it cannot be read or is not valid.
  explicit SafetensorsFile(const std::filesystem::path& path);

  /// Checks a file in memory; `name` replaces the path in messages.
  SafetensorsFile(SharedArray<std::byte> bytes, std::string name);

  const std::string& name() const { return name_; }
  const SafetensorsMetadata& metadata() const { return metadata_; }
  const std::map<std::string, TensorInfo>& tensors() const { return tensors_; }

  /// The header length with the header; the data section follows it.
  std::span<const std::byte> prefix() const { return bytes_.span().first(prefix_size_); }
  std::span<const std::byte> data() const { return bytes_.span().subspan(prefix_size_); }

  /// Throws Error if there is no such tensor.
  const TensorInfo& info(const std::string& tensor) const;

  /// The values of a tensor, in place; the array keeps the file's memory alive. `shape` is the
  /// expected shape, with kAnySize for sizes that may vary. Throws Error that names the tensor if
  /// it is missing or has another type or shape, or if it is not aligned.
  template <typename T>
  SharedArray<T> tensor(const std::string& tensor, const TensorShape& shape,
                        TensorType type = tensor_type<T>()) const {
    const std::span<const std::byte> bytes = checked_bytes(tensor, shape, type, alignof(T));
    return {{reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)}, bytes_.owner()};
  }

 private:
  void parse_header(std::string_view header);
  void check_contiguous() const;
  std::span<const std::byte> checked_bytes(const std::string& tensor, const TensorShape& shape,
                                           TensorType type, std::size_t alignment) const;

  SharedArray<std::byte> bytes_;
  std::string name_;
  std::size_t prefix_size_ = 0;
  SafetensorsMetadata metadata_;
  std::map<std::string, TensorInfo> tensors_;
};

}  // namespace rebounce

#include <algorithm>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "rebounce/error.h"
#include "transfer/file/checked_json.h"
#include "transfer/file/mapped_file.h"
#include "transfer/file/safetensors.h"
#include "transfer/file/safetensors_format.h"

namespace rebounce {
namespace {

using nlohmann::json;

// How deep a header is nested: the header, a tensor, its shape.
constexpr std::size_t kHeaderDepth = 3;

// Errors of a header do not name the file; the constructor adds its name.
[[noreturn]] void refuse_tensor(const std::string& name, const std::string& reason) {
  throw Error("tensor " + json(name).dump() + ": " + reason);
}

std::string to_text(const TensorShape& shape) {
  std::string text = "[";
  for (const std::uint64_t size : shape) {
    if (text.size() > 1) text += ", ";
    text += size == kAnySize ? "any" : std::to_string(size);
  }
  return text + "]";
}

TensorType parse_type(const std::string& name, const json& value) {
  for (std::size_t i = 0; i < kTensorTypes.size(); ++i) {
    if (value == kTensorTypes[i].name) return static_cast<TensorType>(i);
  }
  refuse_tensor(name, "unknown dtype");
}

TensorShape parse_sizes(const std::string& name, const json& value, const char* key) {
  if (!value.is_array()) refuse_tensor(name, std::string(key) + " is not an array");
  TensorShape sizes;
  for (const json& size : value) {
    if (!size.is_number_unsigned()) {
      refuse_tensor(name, std::string(key) + " has an entry that is not a whole number");
    }
    sizes.push_back(size.get<std::uint64_t>());
  }
  return sizes;
}

/// Bytes of a tensor, or nothing if they do not fit 64 bits.
std::optional<std::uint64_t> byte_count(TensorType type, const TensorShape& shape) {
  std::uint64_t bytes = element_size(type);
  for (const std::uint64_t size : shape) {
    if (size != 0 && bytes > std::numeric_limits<std::uint64_t>::max() / size) return {};
    bytes *= size;
  }
  return bytes;
}

TensorInfo parse_tensor(const std::string& name, const json& value, std::uint64_t data_size) {
  if (!value.is_object() || value.size() != 3 || !value.contains("dtype") ||
      !value.contains("shape") || !value.contains("data_offsets")) {
    refuse_tensor(name, "not described by dtype, shape and data_offsets");
  }
  TensorInfo info;
  info.type = parse_type(name, value["dtype"]);
  info.shape = parse_sizes(name, value["shape"], "shape");
  const TensorShape offsets = parse_sizes(name, value["data_offsets"], "data_offsets");
  if (offsets.size() != 2 || offsets[0] > offsets[1]) {
    refuse_tensor(name, "data_offsets are not a range");
  }
  if (offsets[1] > data_size) {
    throw Error("it is truncated: tensor " + json(name).dump() + " ends at byte " +
                std::to_string(offsets[1]) + " of the data, of which there are " +
                std::to_string(data_size));
  }
  info.begin = offsets[0];
  info.end = offsets[1];
  if (byte_count(info.type, info.shape) != info.end - info.begin) {
    refuse_tensor(name, "data_offsets do not agree with dtype and shape");
  }
  return info;
}

SafetensorsMetadata parse_metadata(const json& value) {
  if (!value.is_object()) throw Error("__metadata__ is not an object");
  SafetensorsMetadata metadata;
  for (const auto& [key, text] : value.items()) {
    if (!text.is_string()) throw Error("__metadata__ has a value that is not a string");
    metadata[key] = text.get<std::string>();
  }
  return metadata;
}

/// What the file says; 0 if it is too short for that.
std::uint64_t header_length(std::span<const std::byte> bytes) {
  std::uint64_t length = 0;
  if (bytes.size() >= kHeaderLengthSize) std::memcpy(&length, bytes.data(), kHeaderLengthSize);
  return length;
}

/// Throws Error for a scene, which is easily named instead of the transfer file made of it.
void refuse_scene(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (header_length(bytes) <= kLargestHeader) return;
  if (!text.starts_with("glTF") && !text.starts_with('{')) return;
  throw Error(name + " looks like glTF and is no transfer file; make one of it with precompute");
}

/// The header without its length.
std::string_view header_of(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderLengthSize) throw Error("it is truncated, shorter than a header");
  const std::uint64_t length = header_length(bytes);
  if (length > kLargestHeader) throw Error("the header claims to exceed 100 MB");
  if (length > bytes.size() - kHeaderLengthSize) {
    throw Error("it is truncated: the header exceeds the file");
  }
  const char* begin = reinterpret_cast<const char*>(bytes.data()) + kHeaderLengthSize;
  return {begin, static_cast<std::size_t>(length)};
}

}  // namespace

SafetensorsFile::SafetensorsFile(const std::filesystem::path& path)
    : SafetensorsFile(map_file(path), path.string()) {}

SafetensorsFile::SafetensorsFile(SharedArray<std::byte> bytes, std::string name)
    : bytes_(std::move(bytes)), name_(std::move(name)) {
  refuse_scene(bytes_.span(), name_);
  try {
    const std::string_view header = header_of(bytes_.span());
    prefix_size_ = kHeaderLengthSize + header.size();
    parse_header(header);
    check_contiguous();
  } catch (const Error& error) {
    throw Error(name_ + " is not a valid safetensors file: " + error.what() +
                "; get a complete copy, or make it again");
  }
}

void SafetensorsFile::parse_header(std::string_view header) {
  if (!header.starts_with('{')) throw Error("the header is not a JSON object");
  const json parsed = parse_untrusted_json(header, kHeaderDepth);
  for (const auto& [key, value] : parsed.items()) {
    if (key == kMetadataKey) {
      metadata_ = parse_metadata(value);
    } else {
      tensors_[key] = parse_tensor(key, value, data().size());
    }
  }
}

void SafetensorsFile::check_contiguous() const {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  for (const auto& [tensor, info] : tensors_) ranges.emplace_back(info.begin, info.end);
  std::sort(ranges.begin(), ranges.end());
  std::uint64_t reached = 0;
  for (const auto& [begin, end] : ranges) {
    if (begin != reached) throw Error("tensors overlap or have gaps between them");
    reached = end;
  }
  if (reached != data().size()) throw Error("bytes are left over after the last tensor");
}

const TensorInfo& SafetensorsFile::info(const std::string& tensor) const {
  const auto found = tensors_.find(tensor);
  if (found == tensors_.end()) {
    throw Error(name_ + ": tensor " + tensor + " is missing; make the file again");
  }
  return found->second;
}

std::span<const std::byte> SafetensorsFile::checked_bytes(const std::string& tensor,
                                                          const TensorShape& shape, TensorType type,
                                                          std::size_t alignment) const {
  const TensorInfo& found = info(tensor);
  const bool same_shape = std::equal(found.shape.begin(), found.shape.end(), shape.begin(),
                                     shape.end(), [](std::uint64_t size, std::uint64_t wanted) {
                                       return wanted == kAnySize || size == wanted;
                                     });
  if (found.type != type || !same_shape) {
    throw Error(name_ + ": tensor " + tensor + " is " + std::string(traits(found.type).name) +
                to_text(found.shape) + ", not " + std::string(traits(type).name) + to_text(shape) +
                "; make the file again");
  }
  const std::span<const std::byte> bytes = data().subspan(
      static_cast<std::size_t>(found.begin), static_cast<std::size_t>(found.end - found.begin));
  if (!bytes.empty() && reinterpret_cast<std::uintptr_t>(bytes.data()) % alignment != 0) {
    throw Error(name_ + ": tensor " + tensor +
                " is not aligned to its elements; make the file again");
  }
  return bytes;
}

}  // namespace rebounce

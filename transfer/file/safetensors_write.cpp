#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <nlohmann/json.hpp>

#include "rebounce/error.h"
#include "transfer/file/atomic_file.h"
#include "transfer/file/safetensors.h"
#include "transfer/file/safetensors_format.h"

namespace rebounce {
namespace {

// A cache line, and the widest vector register.
constexpr std::size_t kAlignment = 64;

std::size_t alignment_kept(const TensorView& tensor) {
  const std::size_t size = tensor.bytes.size() | kAlignment;
  return std::size_t{1} << std::countr_zero(size);
}

void sort_for_alignment(std::vector<TensorView>& tensors) {
  std::sort(tensors.begin(), tensors.end(), [](const TensorView& a, const TensorView& b) {
    const std::size_t alignment_a = alignment_kept(a);
    const std::size_t alignment_b = alignment_kept(b);
    return alignment_a != alignment_b ? alignment_a > alignment_b : a.name < b.name;
  });
}

[[maybe_unused]] bool size_agrees(const TensorView& tensor) {
  std::uint64_t size = element_size(tensor.type);
  for (const std::uint64_t count : tensor.shape) size *= count;
  return size == tensor.bytes.size();
}

std::string header_text(const std::vector<TensorView>& tensors,
                        const SafetensorsMetadata& metadata) {
  nlohmann::json header = nlohmann::json::object();
  if (!metadata.empty()) header[std::string(kMetadataKey)] = metadata;
  std::uint64_t begin = 0;
  for (const TensorView& tensor : tensors) {
    assert(size_agrees(tensor));
    if (header.contains(tensor.name) || tensor.name == kMetadataKey) {
      throw Error("tensor " + tensor.name + ": its name is used twice or reserved; rename it");
    }
    const std::uint64_t end = begin + tensor.bytes.size();
    header[tensor.name] = {{"dtype", traits(tensor.type).name},
                           {"shape", tensor.shape},
                           {"data_offsets", {begin, end}}};
    begin = end;
  }
  return header.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// The header with its length before it, padded with spaces to the alignment.
std::string framed(std::string header) {
  const std::size_t unaligned = (kHeaderLengthSize + header.size()) % kAlignment;
  if (unaligned != 0) header.append(kAlignment - unaligned, ' ');
  const std::uint64_t length = header.size();
  if (length > kLargestHeader) throw Error("the header exceeds 100 MB; store fewer names or texts");
  std::string prefix(kHeaderLengthSize, '\0');
  std::memcpy(prefix.data(), &length, kHeaderLengthSize);
  return prefix + header;
}

}  // namespace

std::size_t element_size(TensorType type) {
  return traits(type).size;
}

SafetensorsLayout lay_out_safetensors(std::vector<TensorView> tensors,
                                      const SafetensorsMetadata& metadata) {
  sort_for_alignment(tensors);
  std::string prefix = framed(header_text(tensors, metadata));
  return {std::move(prefix), std::move(tensors)};
}

void write_safetensors(const ByteSink& sink, const SafetensorsLayout& layout) {
  sink(std::as_bytes(std::span(layout.prefix)));
  for (const TensorView& tensor : layout.tensors) sink(tensor.bytes);
}

void write_safetensors(const std::filesystem::path& path, const SafetensorsLayout& layout) {
  AtomicFile file(path);
  write_safetensors([&](std::span<const std::byte> bytes) { file.write(bytes); }, layout);
  file.commit();
}

}  // namespace rebounce

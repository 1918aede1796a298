#include "precompute/compression/block_checkpoint.h"

#include <array>
#include <fstream>
#include <span>
#include <type_traits>

#include "rebounce/error.h"
#include "transfer/file/atomic_file.h"
#include "transfer/file/content_hash.h"

namespace rebounce {
namespace {

static_assert(std::is_trivially_copyable_v<TransferBlock> &&
              sizeof(TransferBlock) == 10 * sizeof(std::uint32_t));

/// "xxh3:", the digits, and zeros.
using HashText = std::array<char, 8 + ContentHash::kDigitCount>;

/// The start of a file; blocks and values follow. A file is read on the machine that wrote it, so
/// its byte order is that of the machine.
struct Header {
  HashText made_for{}, content{};
  std::uint64_t block_count = 0, value_count = 0;
};
static_assert(std::has_unique_object_representations_v<Header>, "every byte is checked");

std::span<const std::byte> bytes_of(const Header& header) {
  return std::as_bytes(std::span(&header, 1));
}

HashText text_of(const ContentHash& hash) {
  HashText text{};
  hash.text().copy(text.data(), text.size());
  return text;
}

HashText hash_of(const std::string& key, const std::string& name) {
  ContentHash hash;
  hash.update(std::as_bytes(std::span(key)));
  hash.update(std::as_bytes(std::span(name)));
  return text_of(hash);
}

HashText hash_of(const BlockPart& part) {
  ContentHash hash;
  hash.update(std::as_bytes(std::span(part.blocks)));
  hash.update(std::as_bytes(std::span(part.values)));
  return text_of(hash);
}

template <typename T>
bool read_into(std::ifstream& stream, std::span<T> target) {
  stream.read(reinterpret_cast<char*>(target.data()),
              static_cast<std::streamsize>(target.size_bytes()));
  return static_cast<bool>(stream);
}

/// True if a file is as long as its header says.
bool fits(const Header& header, std::uintmax_t file_bytes) {
  return header.block_count <= file_bytes / sizeof(TransferBlock) &&
         header.value_count <= file_bytes / sizeof(float) &&
         sizeof(Header) + header.block_count * sizeof(TransferBlock) +
                 header.value_count * sizeof(float) ==
             file_bytes;
}

}  // namespace

BlockCheckpoint::BlockCheckpoint(std::filesystem::path folder, std::string key)
    : folder_(std::move(folder)), key_(std::move(key)) {
  if (folder_.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (!std::filesystem::is_directory(folder_, error)) {
    throw Error(folder_.string() +
                ": cannot be created as a folder for checkpoints; choose another path");
  }
}

void BlockCheckpoint::keep(const std::string& name, const BlockPart& part) const {
  if (!keeps()) return;
  const Header header{hash_of(key_, name), hash_of(part), part.blocks.size(), part.values.size()};
  AtomicFile out(folder_ / name);
  out.write(bytes_of(header));
  out.write(std::as_bytes(std::span(part.blocks)));
  out.write(std::as_bytes(std::span(part.values)));
  out.commit();
}

std::optional<BlockPart> BlockCheckpoint::find(const std::string& name) const {
  if (!keeps()) return std::nullopt;
  const Ranks ranks;
  std::optional<BlockPart> part;
  if (ranks.rank() == 0) part = read(name);
  std::uint8_t found = part ? 1 : 0;
  ranks.share(std::span(&found, 1));
  if (found == 0) return std::nullopt;
  if (!part) part.emplace();
  share(ranks, std::span(&*part, 1));
  return part;
}

std::optional<BlockPart> BlockCheckpoint::read(const std::string& name) const {
  std::ifstream in(folder_ / name, std::ios::binary);
  Header header;
  if (!in || !read_into(in, std::span(&header, 1))) return std::nullopt;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(folder_ / name, error);
  if (error || header.made_for != hash_of(key_, name) || !fits(header, size)) return std::nullopt;
  BlockPart part;
  part.blocks.resize(header.block_count);
  part.values.resize(header.value_count);
  if (!read_into(in, std::span(part.blocks)) || !read_into(in, std::span(part.values)) ||
      hash_of(part) != header.content) {
    return std::nullopt;
  }
  return part;
}

}  // namespace rebounce

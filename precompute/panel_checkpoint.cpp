#include "panel_checkpoint.h"

#include <fmt/format.h>

#include <array>
#include <cassert>
#include <fstream>
#include <span>
#include <type_traits>

#include "rebounce/transfer/atomic_file.h"
#include "rebounce/transfer/content_hash.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

static_assert(std::is_trivially_copyable_v<TransferBlock> &&
              sizeof(TransferBlock) == 7 * sizeof(std::uint32_t));

/// "xxh3:" and the digits.
constexpr std::size_t kTextSize = 5 + ContentHash::kDigitCount;

/// What a file begins with; blocks and values follow. Files are read on the machine that wrote
/// them.
struct Header {
  std::array<char, kTextSize> key{}, content{};
  std::uint64_t block_count = 0, value_count = 0;
};

std::span<const std::byte> bytes_of(const Header& header) {
  return std::as_bytes(std::span(&header, 1));
}

std::array<char, kTextSize> content_hash(const BlockPart& part) {
  ContentHash hash;
  hash.update(std::as_bytes(std::span(part.blocks)));
  hash.update(std::as_bytes(std::span(part.values)));
  std::array<char, kTextSize> text{};
  hash.text().copy(text.data(), text.size());
  return text;
}

template <typename T>
bool read_into(std::ifstream& stream, std::span<T> target) {
  stream.read(reinterpret_cast<char*>(target.data()),
              static_cast<std::streamsize>(target.size_bytes()));
  return static_cast<bool>(stream);
}

}  // namespace

PanelCheckpoint::PanelCheckpoint(std::filesystem::path folder, std::string key)
    : folder_(std::move(folder)), key_(std::move(key)) {
  assert(key_.size() == kTextSize);
  if (folder_.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (!std::filesystem::is_directory(folder_, error)) {
    throw Error(folder_.string() + ": cannot be made a folder for checkpoints; name another");
  }
}

std::filesystem::path PanelCheckpoint::file(std::size_t panel) const {
  return folder_ / fmt::format("panel_{:04}", panel);
}

void PanelCheckpoint::keep(std::size_t panel, const BlockPart& part) const {
  if (folder_.empty()) return;
  Header header;
  key_.copy(header.key.data(), header.key.size());
  header.content = content_hash(part);
  header.block_count = part.blocks.size();
  header.value_count = part.values.size();
  AtomicFile out(file(panel));
  out.write(bytes_of(header));
  out.write(std::as_bytes(std::span(part.blocks)));
  out.write(std::as_bytes(std::span(part.values)));
  out.commit();
}

std::optional<BlockPart> PanelCheckpoint::find(std::size_t panel) const {
  if (folder_.empty()) return std::nullopt;
  std::ifstream in(file(panel), std::ios::binary);
  Header header;
  if (!in || !read_into(in, std::span(&header, 1))) return std::nullopt;
  if (std::string_view(header.key.data(), header.key.size()) != key_) return std::nullopt;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file(panel), error);
  if (error || header.block_count > size / sizeof(TransferBlock) ||
      header.value_count > size / sizeof(float)) {
    return std::nullopt;
  }
  BlockPart part;
  part.blocks.resize(header.block_count);
  part.values.resize(header.value_count);
  if (!read_into(in, std::span(part.blocks)) || !read_into(in, std::span(part.values)) ||
      content_hash(part) != header.content) {
    return std::nullopt;
  }
  return part;
}

}  // namespace rebounce

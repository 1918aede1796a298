#include "precompute/base/checkpoint.h"

#include <array>
#include <fstream>

#include "rebounce/error.h"
#include "transfer/file/atomic_file.h"
#include "transfer/file/content_hash.h"

namespace rebounce {
namespace {

/// "xxh3:", the digits, and zeros.
using HashText = std::array<char, 8 + ContentHash::kDigitCount>;

/// The start of a file; the bytes of each array follow, first their numbers and then themselves. A
/// file is read on the machine that wrote it, so its byte order is that of the machine.
struct Header {
  HashText made_for{}, content{};
  std::uint64_t array_count = 0;
};
static_assert(std::has_unique_object_representations_v<Header>, "every byte is checked");

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

bool read_into(std::ifstream& stream, std::span<std::byte> target) {
  stream.read(reinterpret_cast<char*>(target.data()), static_cast<std::streamsize>(target.size()));
  return static_cast<bool>(stream);
}

}  // namespace

Checkpoint::Checkpoint(std::filesystem::path folder, std::string key)
    : folder_(std::move(folder)), key_(std::move(key)) {
  if (folder_.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (!std::filesystem::is_directory(folder_, error)) {
    throw Error(folder_.string() +
                ": cannot be created as a folder for checkpoints; choose another path");
  }
  if (Ranks().rank() == 0) const AtomicFile never_committed(folder_ / "checkpoint");
}

void Checkpoint::write(const std::string& name,
                       const std::vector<std::span<const std::byte>>& arrays) const {
  std::vector<std::uint64_t> sizes;
  for (const std::span<const std::byte> array : arrays) sizes.push_back(array.size());
  ContentHash content;
  content.update(std::as_bytes(std::span(sizes)));
  for (const std::span<const std::byte> array : arrays) content.update(array);
  const Header header{hash_of(key_, name), text_of(content), arrays.size()};
  AtomicFile out(folder_ / name);
  out.write(std::as_bytes(std::span(&header, 1)));
  out.write(std::as_bytes(std::span(sizes)));
  for (const std::span<const std::byte> array : arrays) out.write(array);
  out.commit();
}

bool Checkpoint::read(const std::string& name, const std::vector<Target>& targets) const {
  std::ifstream in(folder_ / name, std::ios::binary);
  Header header;
  std::vector<std::uint64_t> sizes(targets.size());
  if (!in || !read_into(in, std::as_writable_bytes(std::span(&header, 1))) ||
      header.made_for != hash_of(key_, name) || header.array_count != targets.size() ||
      !read_into(in, std::as_writable_bytes(std::span(sizes)))) {
    return false;
  }
  std::error_code error;
  std::uintmax_t rest = std::filesystem::file_size(folder_ / name, error);
  if (error) return false;
  rest -= sizeof(header) + sizes.size() * sizeof(std::uint64_t);  // which were read
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    if (sizes[k] > rest || sizes[k] % targets[k].item_bytes != 0) return false;
    rest -= sizes[k];
  }
  if (rest != 0) return false;
  ContentHash content;
  content.update(std::as_bytes(std::span(sizes)));
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const std::span<std::byte> array = targets[k].resize(sizes[k] / targets[k].item_bytes);
    if (!read_into(in, array)) return false;
    content.update(array);
  }
  return text_of(content) == header.content;
}

}  // namespace rebounce

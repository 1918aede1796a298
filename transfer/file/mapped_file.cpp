#include "transfer/file/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <system_error>

#include "rebounce/error.h"
#include "transfer/base/machine_memory.h"

namespace rebounce {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
  throw Error("cannot read " + path.string() + ": " + reason + "; check its name and permissions");
}

/// After a call that has failed. Throws std::bad_alloc if there was no memory for it, Error
/// otherwise.
[[noreturn]] void fail_by_errno(const std::filesystem::path& path) {
  if (errno == ENOMEM) throw std::bad_alloc();
  fail(path, std::generic_category().message(errno));
}

/// Throws Error if the machine has less memory than the file has bytes. All of them are read at
/// once, and the operator again in every frame.
void check_memory_for(const std::filesystem::path& path, std::uint64_t size) {
  const std::uint64_t memory = machine_memory_bytes();
  if (size <= memory) return;
  const auto gib = [](std::uint64_t bytes) { return std::to_string(bytes >> 30) + " GiB"; };
  throw Error("cannot read " + path.string() + ": it has " + gib(size) + ", this machine " +
              gib(memory) + " of memory; make it with fewer patches or without form factors");
}

class Descriptor {
 public:
  explicit Descriptor(const std::filesystem::path& path)
      // O_NONBLOCK: a pipe is refused at once instead of waited for.
      : value_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    if (value_ < 0) fail_by_errno(path);
  }
  ~Descriptor() { ::close(value_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int value() const { return value_; }

 private:
  int value_;
};

class Mapping {
 public:
  Mapping(const std::filesystem::path& path, const Descriptor& descriptor, std::size_t size)
      : address_(::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor.value(), 0)),
        size_(size) {
    if (address_ == MAP_FAILED) fail_by_errno(path);
  }
  ~Mapping() { ::munmap(address_, size_); }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  std::span<const std::byte> bytes() const {
    return {static_cast<const std::byte*>(address_), size_};
  }

 private:
  void* address_;
  std::size_t size_;
};

}  // namespace

SharedArray<std::byte> map_file(const std::filesystem::path& path) {
  const Descriptor descriptor(path);
  struct stat status {};
  if (::fstat(descriptor.value(), &status) != 0) fail_by_errno(path);
  if (!S_ISREG(status.st_mode)) fail(path, "it is not a regular file");
  if (status.st_size == 0) return {};  // mmap does not map empty files
  check_memory_for(path, static_cast<std::uint64_t>(status.st_size));
  auto mapping =
      std::make_shared<const Mapping>(path, descriptor, static_cast<std::size_t>(status.st_size));
  const std::span<const std::byte> bytes = mapping->bytes();
  return {bytes, std::move(mapping)};
}

}  // namespace rebounce

#include "transfer/file/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <string>
#include <system_error>

#include "rebounce/error.h"

namespace rebounce {
namespace fs = std::filesystem;

namespace {

// Linux writes at most 2 GiB in one call.
constexpr std::size_t kLargestWrite = std::size_t{1} << 30;

std::string advice(int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return "; create the folder first";
    case EACCES:
    case EPERM:
    case EROFS:
      return "; choose a folder that you may write to";
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "; free some space or choose another disk";
    default:
      return "; choose another place to write to";
  }
}

[[noreturn]] void fail(const fs::path& target, int error) {
  throw Error("cannot write " + target.string() + ": " + std::generic_category().message(error) +
              advice(error));
}

/// Follows a symbolic link `target`, so that the rename replaces the file and not the link.
fs::path resolve(const fs::path& target) {
  std::error_code error;
  if (!fs::is_symlink(target, error)) return target;
  fs::path resolved = fs::weakly_canonical(target, error);
  if (error) fail(target, error.value());
  return resolved;
}

fs::path temporary_name(const fs::path& target) {
  static std::atomic<std::uint64_t> counter{0};
  fs::path name(".");
  name += target.filename();
  name += '.';
  name += std::to_string(::getpid()) + "-" + std::to_string(++counter) + ".tmp";
  return target.parent_path() / name;
}

/// Waits until `path` is on disk. Returns 0 or the error number.
int sync(const fs::path& path, int open_flags) {
  const int descriptor = ::open(path.c_str(), open_flags | O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  return error == EINVAL ? 0 : error;  // EINVAL: this file system does not support it
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& target) : target_(resolve(target)) {
  std::error_code error;
  const fs::file_status status = fs::status(target_, error);
  if (target_.filename().empty() || (fs::exists(status) && !fs::is_regular_file(status))) {
    throw Error("cannot write " + target.string() +
                ": it is not a regular file; choose a file name");
  }
  do {
    temporary_ = temporary_name(target_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && errno == EEXIST);
  if (descriptor_ < 0) fail(target_, errno);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!committed_) ::unlink(temporary_.c_str());
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written =
        ::write(descriptor_, bytes.data(), std::min(bytes.size(), kLargestWrite));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(target_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void AtomicFile::close() {
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (::close(descriptor) != 0) fail(target_, errno);
}

void AtomicFile::commit() {
  close();
  // By name: a library that wrote to temporary_path() may have replaced the file.
  if (const int error = sync(temporary_, 0)) fail(target_, error);
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(target_, errno);
  committed_ = true;
  const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  if (const int error = sync(folder, O_DIRECTORY)) fail(target_, error);
}

}  // namespace rebounce

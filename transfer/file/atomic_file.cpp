#include "transfer/file/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <string>
#include <string_view>
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

/// Follows a symbolic link `target`, so that the rename replaces the file and not the link. The
/// file need not exist.
fs::path resolve(const fs::path& target) {
  constexpr int kMostLinks = 40;  // as Linux follows
  std::error_code error;
  fs::path resolved = target;
  for (int k = 0; fs::is_symlink(resolved, error); ++k) {
    const fs::path next = fs::read_symlink(resolved, error);
    if (error || k == kMostLinks) fail(target, error ? error.value() : ELOOP);
    resolved = resolved.parent_path() / next;  // `next` itself if it is absolute
  }
  return resolved;
}

// A temporary file is called .NAME.rebounce-PROCESS-NUMBER.tmp, and what a library writes in its
// place has a name that begins with that.
constexpr std::string_view kEnding = ".tmp";
constexpr std::string_view kLibraryEnding = ".library";

std::string temporary_beginning(const fs::path& target) {
  return std::string(".").append(target.filename().string()).append(".rebounce-");
}

fs::path temporary_name(const fs::path& target) {
  static std::atomic<std::uint64_t> counter{0};
  return target.parent_path() / (temporary_beginning(target) + std::to_string(::getpid()) + "-" +
                                 std::to_string(++counter) + std::string(kEnding));
}

/// The name of the temporary file for `target` that a file called `name` belongs to; empty if to
/// none.
std::string temporary_of(const fs::path& target, const std::string& name) {
  const std::string beginning = temporary_beginning(target);
  if (!name.starts_with(beginning)) return {};
  const std::size_t ending = name.find_first_not_of("0123456789-", beginning.size());
  if (ending == std::string::npos || ending == beginning.size()) return {};
  const bool is_temporary = std::string_view(name).substr(ending).starts_with(kEnding);
  return is_temporary ? name.substr(0, ending + kEnding.size()) : std::string();
}

/// Removes `file`, which is `temporary` or belongs to it, unless a process that lives writes to
/// that. The lock is held meanwhile, so that none begins to.
void remove_if_left_over(const fs::path& file, const fs::path& temporary) {
  const int descriptor = ::open(temporary.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  const bool has_no_writer =
      descriptor < 0 ? errno == ENOENT : ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  if (has_no_writer) ::unlink(file.c_str());
  if (descriptor >= 0) ::close(descriptor);
}

/// Removes what killed processes have left beside `target`. What cannot be removed stays.
void remove_left_over(const fs::path& target) {
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const std::string temporary = temporary_of(target, name);
    if (!temporary.empty()) remove_if_left_over(folder / name, folder / temporary);
  }
}

bool is_linked(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && status.st_nlink > 0;
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
  remove_left_over(target_);
  open_and_lock();
}

AtomicFile::~AtomicFile() {
  std::error_code error;
  fs::remove(path_for_library(), error);
  ::unlink(temporary_.c_str());  // after commit() there is none
  ::close(descriptor_);
}

void AtomicFile::open_and_lock() {
  for (;;) {
    temporary_ = temporary_name(target_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0 && errno == EEXIST) continue;
    if (descriptor_ < 0) fail(target_, errno);
    // File systems without locks do without. Before it was locked another process may have taken
    // the file for one that was left over.
    while (::flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) {
    }
    if (is_linked(descriptor_)) return;
    ::close(descriptor_);
  }
}

fs::path AtomicFile::path_for_library() const {
  fs::path path = temporary_;
  path += kLibraryEnding;
  return path;
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

void AtomicFile::commit() {
  std::error_code none;
  const bool by_library = fs::exists(path_for_library(), none);
  const fs::path written = by_library ? path_for_library() : temporary_;
  if (const int error = sync(written, 0)) fail(target_, error);
  if (::rename(written.c_str(), target_.c_str()) != 0) fail(target_, errno);
  const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  const int error = sync(folder, O_DIRECTORY);
  if (error != 0 && error != EACCES) fail(target_, error);  // EACCES: it may not be opened to read
}

}  // namespace rebounce

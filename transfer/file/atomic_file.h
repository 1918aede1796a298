#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace rebounce {

/// A file that appears under its name completely or not at all.
///
/// Bytes go into a temporary file beside the target. commit() flushes it to disk and renames it
/// over the target. Without commit(), for example after an exception, the destructor removes the
/// temporary file and the target is unchanged. A process that is killed leaves it behind; the next
/// AtomicFile for the same target removes it. The writer holds a lock on its temporary file while
/// it lives, so that those of others who write to the same target are left alone.
class AtomicFile {
 public:
  /// Creates the temporary file. If the target is a symbolic link, the file it points to is
  /// replaced. Throws Error if the folder is missing or not writable, or if the target exists and
  /// is not a regular file. Removes what killed processes left of earlier files for this target.
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// A path for a library that writes the file itself, in place of write(). It does not exist at
  /// first. A library may make further files whose names begin with it; it removes them itself.
  std::filesystem::path path_for_library() const;

  /// Appends `bytes`. Throws Error if the disk is full or fails.
  void write(std::span<const std::byte> bytes);

  /// Flushes the file, renames it and flushes the folder, if that may be read. Call it once, last.
  /// Throws Error if one of these fails.
  void commit();

 private:
  void open_and_lock();

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;  ///< holds the lock
};

}  // namespace rebounce

#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace rebounce {

/// A file that appears under its name whole or not at all.
///
/// Bytes go into a temporary file beside the target; commit() flushes it to disk and renames it
/// over the target. Without a commit, an exception included, the destructor removes the temporary
/// file and the target is as it was.
class AtomicFile {
 public:
  /// Creates the temporary file. A target that is a symbolic link stands for what it points at.
  /// Throws Error when the folder is missing or not writable, or when the target exists and is not
  /// a regular file.
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Where the bytes are until commit(), for a library that insists on opening the file itself.
  const std::filesystem::path& temporary_path() const { return temporary_; }

  /// Appends `bytes`. Throws Error when the disk is full or fails.
  void write(std::span<const std::byte> bytes);

  /// Flushes the file, gives it its name and flushes the folder. Call it once, last. Throws Error
  /// when any of it fails.
  void commit();

 private:
  void close();

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool committed_ = false;
};

}  // namespace rebounce

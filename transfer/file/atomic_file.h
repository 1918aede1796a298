#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace rebounce {

/// A file that appears under its name completely or not at all.
///
/// Bytes go into a temporary file beside the target. commit() flushes it to disk and renames it
/// over the target. Without commit(), for example after an exception, the destructor removes the
/// temporary file and the target is unchanged.
class AtomicFile {
 public:
  /// Creates the temporary file. If the target is a symbolic link, the file it points to is
  /// replaced. Throws Error if the folder is missing or not writable, or if the target exists and
  /// is not a regular file.
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The path of the bytes until commit(), for libraries that open the file themselves.
  const std::filesystem::path& temporary_path() const { return temporary_; }

  /// Appends `bytes`. Throws Error if the disk is full or fails.
  void write(std::span<const std::byte> bytes);

  /// Flushes the file, renames it and flushes the folder. Call it once, last. Throws Error if one
  /// of these fails.
  void commit();

 private:
  void close();

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool committed_ = false;
};

}  // namespace rebounce

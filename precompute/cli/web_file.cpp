#include "precompute/cli/web_file.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "rebounce/error.h"
#include "transfer/file/atomic_file.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::cli {
namespace {

// Of the 23 bits behind the point of a float, 12 stay: a weight is off by 1.2e-4 of itself at most,
// and what is cut off packs to nothing.
constexpr std::uint32_t kDroppedBits = 11;

void shorten(float& value) {
  constexpr std::uint32_t half = 1U << (kDroppedBits - 1), kept = ~((1U << kDroppedBits) - 1);
  value = std::bit_cast<float>((std::bit_cast<std::uint32_t>(value) + half) & kept);
}

/// A file that is packed with gzip as it is written.
class PackedFile {
 public:
  explicit PackedFile(const std::filesystem::path& path) : file_(path), packed_(kPiece) {
    constexpr int kGzipWindow = 15 + 16;  // 16: with the header of gzip
    if (deflateInit2(&stream_, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, 9,
                     Z_DEFAULT_STRATEGY) != Z_OK) {
      throw Error("out of memory while a file is packed");
    }
  }
  ~PackedFile() { deflateEnd(&stream_); }
  PackedFile(const PackedFile&) = delete;
  PackedFile& operator=(const PackedFile&) = delete;

  void add(std::span<const std::byte> bytes) {
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(kPiece, bytes.size()))) {
      pack(bytes.first(std::min(kPiece, bytes.size())), Z_NO_FLUSH);
    }
  }

  /// Writes what is left. Do so with all files that belong together before one is committed.
  void finish() { pack({}, Z_FINISH); }

  /// After finish().
  void commit() { file_.commit(); }

  std::uint64_t size() const { return size_; }

 private:
  static constexpr std::size_t kPiece = 1 << 20;  // of what zlib is given at once

  void pack(std::span<const std::byte> bytes, int flush) {
    // It only reads there.
    stream_.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(bytes.size());
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(packed_.data());
      stream_.avail_out = static_cast<uInt>(packed_.size());
      if (deflate(&stream_, flush) == Z_STREAM_ERROR) throw Error("a file could not be packed");
      const std::span made = std::span(packed_).first(packed_.size() - stream_.avail_out);
      file_.write(made);
      size_ += made.size();
    } while (stream_.avail_out == 0);
  }

  AtomicFile file_;
  std::vector<std::byte> packed_;
  z_stream stream_{};
  std::uint64_t size_ = 0;
};

}  // namespace

std::filesystem::path form_factor_file_beside(const std::filesystem::path& path) {
  return std::filesystem::path(path).replace_extension(".form_factors.safetensors");
}

std::uint64_t save_web_files(const std::filesystem::path& path, TransferData data) {
  const auto form_factors = std::exchange(data.compressed_form_factors, nullptr);
  data.emitted_irradiance = {};
  data.exchange = {};
  data.links = {};
  data.lightmap = {};
  data.surface_harmonics = {};
  for (float& weight : data.mesh.weight) shorten(weight);
  for (Harmonics& weights : data.probes.entry_weight) {
    for (float& weight : weights) shorten(weight);
  }
  PackedFile file(path);
  const auto sink_of = [](PackedFile& to) {
    return [&to](std::span<const std::byte> piece) { to.add(piece); };
  };
  write_transfer_file(sink_of(file), data);
  file.finish();
  const std::filesystem::path beside = form_factor_file_beside(path);
  if (form_factors == nullptr) {
    file.commit();
    std::error_code none;  // it belongs to a file that has been replaced, if it is there
    std::filesystem::remove(beside, none);
    return file.size();
  }
  data.compressed_form_factors = form_factors;
  PackedFile second(beside);
  write_form_factor_file(sink_of(second), data);
  second.finish();
  file.commit();
  second.commit();
  return file.size() + second.size();
}

}  // namespace rebounce::cli

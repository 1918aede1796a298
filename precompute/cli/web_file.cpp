#include "precompute/cli/web_file.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
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

std::vector<std::byte> gzip(std::span<const std::byte> bytes) {
  constexpr int kGzipWindow = 15 + 16;  // 16: with the header of gzip
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, 9, Z_DEFAULT_STRATEGY) !=
      Z_OK) {
    throw Error("out of memory while a file is packed");
  }
  const std::uint64_t most = deflateBound(&stream, bytes.size());
  if (std::max<std::uint64_t>(most, bytes.size()) > std::numeric_limits<uInt>::max()) {
    deflateEnd(&stream);
    throw Error("a file of more than 4 GiB cannot be packed; ask for fewer patches");
  }
  std::vector<std::byte> packed(most);
  // It only reads there.
  stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int result = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (result != Z_STREAM_END) throw Error("a file could not be packed");
  return packed;
}

/// Packs what `write` gives to a sink.
std::uint64_t save_packed(const std::filesystem::path& path, const auto& write) {
  std::vector<std::byte> bytes;
  write([&](std::span<const std::byte> piece) {
    bytes.insert(bytes.end(), piece.begin(), piece.end());
  });
  const std::vector<std::byte> packed = gzip(bytes);
  AtomicFile file(path);
  file.write(packed);
  file.commit();
  return packed.size();
}

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
  std::uint64_t size =
      save_packed(path, [&](const ByteSink& sink) { write_transfer_file(sink, data); });
  if (form_factors != nullptr) {
    data.compressed_form_factors = form_factors;
    size += save_packed(form_factor_file_beside(path),
                        [&](const ByteSink& sink) { write_form_factor_file(sink, data); });
  }
  return size;
}

}  // namespace rebounce::cli

// PNG by libpng and JPEG by libjpeg-turbo.

#include "runtime/images/coded_image.h"

#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <type_traits>

#include "rebounce/error.h"

namespace rebounce {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint64_t kMaxDecodedBytes = std::uint64_t{1} << 30;
constexpr std::size_t kRgba = 4;

template <std::size_t N>
bool starts_with(Bytes encoded, const std::array<std::uint8_t, N>& magic) {
  return encoded.size() >= N && std::equal(magic.begin(), magic.end(), encoded.begin());
}

std::uint64_t big_endian_u32(Bytes bytes, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | bytes[offset + i];
  return value;
}

struct PixelSize {
  std::uint64_t columns = 0, rows = 0;
  std::uint64_t least_bytes = 0;  ///< that the format can hold so many pixels in
};

RgbaImage empty_image(const PixelSize& size) {
  return {static_cast<int>(size.columns), static_cast<int>(size.rows),
          std::vector<std::uint8_t>(kRgba * size.columns * size.rows)};
}

// Whether room for the pixels may be taken.
bool is_plausible(const PixelSize& size, Bytes encoded) {
  return size.columns > 0 && size.rows > 0 && encoded.size() >= size.least_bytes;
}

// What the first chunk of a PNG says; empty if it is not a header.
std::optional<PixelSize> png_size(Bytes encoded) {
  constexpr std::array<std::uint8_t, 4> kHeaderChunk{'I', 'H', 'D', 'R'};
  constexpr std::size_t kType = 12, kWidth = 16, kHeight = 20, kDepth = 24, kColour = 25;
  constexpr std::array<std::uint64_t, 7> kChannels{1, 0, 3, 1, 2, 0, 4};  // by colour type
  constexpr std::uint64_t kMaxDeflation = 1032;                           // of the format
  if (encoded.size() <= kColour || !starts_with(encoded.subspan(kType), kHeaderChunk)) return {};
  PixelSize size{big_endian_u32(encoded, kWidth), big_endian_u32(encoded, kHeight)};
  const std::uint8_t colour = encoded[kColour];
  if (colour >= kChannels.size()) return {};
  refuse_large_image(size.columns, size.rows);
  const std::uint64_t row = size.columns * encoded[kDepth] * kChannels[colour] / 8 + 1;
  size.least_bytes = size.rows * row / kMaxDeflation;
  return size;
}

[[noreturn]] void leave(png_structp png, png_const_charp /*message*/) {
  png_longjmp(png, 1);
}
void say_nothing(png_structp /*png*/, png_const_charp /*message*/) {}

void read_bytes(png_structp png, png_bytep to, png_size_t count) {
  Bytes& left = *static_cast<Bytes*>(png_get_io_ptr(png));
  if (count > left.size()) png_error(png, "too short");
  std::memcpy(to, left.data(), count);
  left = left.subspan(count);
}

// False if libpng gave up. libpng comes back here by longjmp: nothing in it has a destructor, and
// what it fills is the caller's.
bool read_png(png_structp png, png_infop info, Bytes* encoded, png_bytep* rows,
              std::uint64_t row_bytes) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, encoded, read_bytes);
  png_read_info(png, info);
  png_set_scale_16(png);
  png_set_expand(png);
  png_set_gray_to_rgb(png);
  png_set_add_alpha(png, 0xFF, PNG_FILLER_AFTER);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_rowbytes(png, info) != row_bytes) return false;
  png_read_image(png, rows);
  return true;
}

std::optional<RgbaImage> decode_png(Bytes encoded) {
  const auto size = png_size(encoded);
  if (!size || !is_plausible(*size, encoded)) return {};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, say_nothing);
  if (png == nullptr) throw std::bad_alloc();
  png_infop info = png_create_info_struct(png);
  const auto end = [&info](png_structp p) { png_destroy_read_struct(&p, &info, nullptr); };
  const std::unique_ptr<std::remove_pointer_t<png_structp>, decltype(end)> owner(png, end);
  if (info == nullptr) throw std::bad_alloc();

  RgbaImage image = empty_image(*size);
  const std::size_t row_bytes = kRgba * size->columns;
  std::vector<png_bytep> rows;
  for (std::size_t row = 0; row < size->rows; ++row) {
    rows.push_back(image.rgba.data() + row * row_bytes);
  }
  if (!read_png(png, info, &encoded, rows.data(), row_bytes)) return {};
  return image;
}

std::optional<RgbaImage> decode_jpeg(Bytes encoded) {
  constexpr std::uint64_t kMaxPixelsPerByte = 512;  // a bit for a block of 8 x 8
  const auto end = [](tjhandle handle) { tjDestroy(handle); };
  const std::unique_ptr<void, decltype(end)> decoder(tjInitDecompress(), end);
  if (!decoder) throw std::bad_alloc();
  int width = 0, height = 0, subsampling = 0, colour_space = 0;
  if (tjDecompressHeader3(decoder.get(), encoded.data(), encoded.size(), &width, &height,
                          &subsampling, &colour_space) != 0 ||
      width <= 0 || height <= 0) {
    return {};
  }
  PixelSize size{static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height)};
  refuse_large_image(size.columns, size.rows);
  size.least_bytes = size.columns * size.rows / kMaxPixelsPerByte;
  if (!is_plausible(size, encoded)) return {};
  RgbaImage image = empty_image(size);
  if (tjDecompress2(decoder.get(), encoded.data(), encoded.size(), image.rgba.data(), width, 0,
                    height, TJPF_RGBA, TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS) == 0) {
    return image;
  }
  // Small faults of writers are only warned of, and do no harm. So is a file that is cut off.
  const bool is_whole = tjGetErrorCode(decoder.get()) == TJERR_WARNING &&
                        !std::string_view(tjGetErrorStr2(decoder.get())).starts_with("Premature");
  if (!is_whole) return {};
  return image;
}

}  // namespace

void refuse_large_image(std::uint64_t columns, std::uint64_t rows) {
  if (rows == 0 || columns <= kMaxDecodedBytes / kRgba / rows) return;
  throw Error("an image of " + std::to_string(columns) + " x " + std::to_string(rows) +
              " pixels is too large (at most 1 GiB); scale it down");
}

std::optional<RgbaImage> decode_png_or_jpeg(Bytes encoded) {
  constexpr std::array<std::uint8_t, 4> kPng{0x89, 'P', 'N', 'G'};
  constexpr std::array<std::uint8_t, 3> kJpeg{0xFF, 0xD8, 0xFF};
  if (starts_with(encoded, kPng)) return decode_png(encoded);
  if (starts_with(encoded, kJpeg)) return decode_jpeg(encoded);
  return {};
}

std::vector<std::uint8_t> encode_png(int width, int height, int channels, Bytes pixels) {
  const bool is_whole =
      width > 0 && height > 0 && (channels == 3 || channels == 4) &&
      pixels.size() / static_cast<std::size_t>(width) / static_cast<std::size_t>(height) ==
          static_cast<std::size_t>(channels);
  if (!is_whole) throw Error("PNG: a size that does not go with the pixels");
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(width);
  header.height = static_cast<png_uint_32>(height);
  header.format = channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  png_alloc_size_t byte_count = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::vector<std::uint8_t> bytes(byte_count);
  if (!png_image_write_to_memory(&header, bytes.data(), &byte_count, 0, pixels.data(), 0,
                                 nullptr)) {
    throw Error("PNG: libpng could not encode it: " + std::string(header.message) +
                "; check its size");
  }
  bytes.resize(byte_count);
  return bytes;
}

}  // namespace rebounce

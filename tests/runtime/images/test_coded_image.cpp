#include <gtest/gtest.h>
#include <png.h>
#include <turbojpeg.h>

#include <cstdlib>
#include <cstring>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "rebounce/error.h"
#include "runtime/images/coded_image.h"

namespace rebounce::test_coded_image {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kWidth = 19, kHeight = 11;
constexpr std::size_t kPngHeaderBytes = 33;  // signature and first chunk

Bytes random_pixels(int channels) {
  std::mt19937 random(7);
  Bytes pixels(static_cast<std::size_t>(kWidth * kHeight * channels));
  for (std::uint8_t& byte : pixels) byte = static_cast<std::uint8_t>(random());
  return pixels;
}

// Pixels that JPEG keeps: a slow gradient.
Bytes gradient() {
  Bytes pixels;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (const int value : {10 * x, 20 * y, 128}) {
        pixels.push_back(static_cast<std::uint8_t>(value));
      }
    }
  }
  return pixels;
}

Bytes jpeg_of(const Bytes& rgb, int flags = 0) {
  const tjhandle encoder = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long count = 0;  // NOLINT(google-runtime-int): the library's type
  EXPECT_EQ(tjCompress2(encoder, rgb.data(), kWidth, 0, kHeight, TJPF_RGB, &bytes, &count,
                        TJSAMP_444, 95, flags),
            0);
  Bytes jpeg(bytes, bytes + count);
  tjFree(bytes);
  tjDestroy(encoder);
  return jpeg;
}

// A PNG of libpng's format `format`, from pixels of 8 or 16 bits.
Bytes png_of(png_uint_32 format, const void* pixels, int flags = 0) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = kWidth;
  header.height = kHeight;
  header.format = format;
  header.flags = static_cast<png_uint_32>(flags);
  png_alloc_size_t count = PNG_IMAGE_PNG_SIZE_MAX(header);
  Bytes bytes(count);
  EXPECT_TRUE(png_image_write_to_memory(&header, bytes.data(), &count, 0, pixels, 0, nullptr));
  bytes.resize(count);
  return bytes;
}

Bytes with_chunk_after_header(const Bytes& png, const std::string& type, const Bytes& data) {
  Bytes chunk{0, 0, 0, static_cast<std::uint8_t>(data.size())};
  chunk.insert(chunk.end(), type.begin(), type.end());
  chunk.insert(chunk.end(), data.begin(), data.end());
  std::uint32_t crc = ~0U;
  for (std::size_t i = 4; i < chunk.size(); ++i) {
    crc ^= chunk[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320U : 0);
  }
  for (int shift = 24; shift >= 0; shift -= 8) {
    chunk.push_back(static_cast<std::uint8_t>(~crc >> shift));
  }
  Bytes all = png;
  all.insert(all.begin() + kPngHeaderBytes, chunk.begin(), chunk.end());
  return all;
}

TEST(CodedImage, PngKeepsEveryByte) {
  for (const int channels : {3, 4}) {
    const Bytes pixels = random_pixels(channels);
    const auto image = decode_png_or_jpeg(encode_png(kWidth, kHeight, channels, pixels));
    ASSERT_TRUE(image);
    ASSERT_EQ(image->width, kWidth);
    ASSERT_EQ(image->height, kHeight);
    for (std::size_t k = 0; k < image->rgba.size(); ++k) {
      const std::size_t channel = k % 4;
      const std::uint8_t expected =
          channel == 3 && channels == 3
              ? 255
              : pixels[k / 4 * static_cast<std::size_t>(channels) + channel];
      ASSERT_EQ(image->rgba[k], expected) << k;
    }
  }
}

TEST(CodedImage, GreyPngBecomesColour) {
  const Bytes grey = random_pixels(2);
  const auto image = decode_png_or_jpeg(png_of(PNG_FORMAT_GA, grey.data()));
  ASSERT_TRUE(image);
  for (std::size_t k = 0; k < grey.size() / 2; ++k) {
    for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(image->rgba[4 * k + c], grey[2 * k]);
    ASSERT_EQ(image->rgba[4 * k + 3], grey[2 * k + 1]);
  }
}

// glTF 2.0, section 3.8.4: what a PNG says of colour spaces is ignored.
TEST(CodedImage, GammaOfPngIsIgnored) {
  const Bytes pixels = random_pixels(3);
  const Bytes gamma_of_one{0, 1, 0x86, 0xA0};
  const auto image = decode_png_or_jpeg(
      with_chunk_after_header(png_of(PNG_FORMAT_RGB, pixels.data()), "gAMA", gamma_of_one));
  ASSERT_TRUE(image);
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    ASSERT_EQ(image->rgba[k / 3 * 4 + k % 3], pixels[k]);
  }
}

TEST(CodedImage, JpegIsNearItsSource) {
  for (const int flags : {0, TJFLAG_PROGRESSIVE}) {
    const Bytes pixels = gradient();
    const auto image = decode_png_or_jpeg(jpeg_of(pixels, flags));
    ASSERT_TRUE(image);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      ASSERT_NEAR(image->rgba[k / 3 * 4 + k % 3], pixels[k], 6) << k;
    }
    EXPECT_EQ(image->rgba[3], 255);
  }
}

TEST(CodedImage, WhatIsCutOffIsRefused) {
  for (const Bytes& whole :
       {encode_png(kWidth, kHeight, 3, random_pixels(3)), jpeg_of(gradient())}) {
    for (std::size_t count = 0; count + 20 < whole.size(); count += 7) {
      const std::span<const std::uint8_t> part(whole.data(), count);
      EXPECT_FALSE(decode_png_or_jpeg(part)) << count << " of " << whole.size();
    }
  }
}

TEST(CodedImage, FlippedBitsDoNoHarm) {
  constexpr unsigned kSeed = 12;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  int read = 0, refused = 0;
  for (const Bytes& whole : {encode_png(kWidth, kHeight, 3, random_pixels(3)), jpeg_of(gradient()),
                             jpeg_of(gradient(), TJFLAG_PROGRESSIVE)}) {
    for (int trial = 0; trial < 300; ++trial) {
      Bytes damaged = whole;
      damaged[random() % damaged.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
      try {
        const auto image = decode_png_or_jpeg(damaged);
        ++(image ? read : refused);
        if (!image) continue;
        EXPECT_EQ(image->rgba.size(), 4U * static_cast<std::size_t>(image->width) *
                                          static_cast<std::size_t>(image->height));
      } catch (const Error& error) {
        ++refused;
        EXPECT_NE(std::string(error.what()).find("too large"), std::string::npos);
      }
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 100);
}

// A few bytes cannot hold so many pixels; no room is made for them.
TEST(CodedImage, SizesThatTheFileCannotHoldAreRefused) {
  Bytes png = encode_png(kWidth, kHeight, 3, random_pixels(3));
  for (const std::size_t byte : {18U, 22U}) png[byte] = 0x3F;  // 16,147 x 16,139
  EXPECT_FALSE(decode_png_or_jpeg(png));
  for (const std::size_t byte : {16U, 17U, 20U, 21U}) png[byte] = 0xFF;
  EXPECT_THROW(decode_png_or_jpeg(png), Error);
}

TEST(CodedImage, SizesWithoutTheirPixelsAreRefused) {
  const Bytes pixels = random_pixels(3);
  EXPECT_THROW(encode_png(kWidth, kHeight + 1, 3, pixels), Error);
  EXPECT_THROW(encode_png(kWidth, kHeight, 4, pixels), Error);
  EXPECT_THROW(encode_png(0, kHeight, 3, pixels), Error);
}

}  // namespace
}  // namespace rebounce::test_coded_image

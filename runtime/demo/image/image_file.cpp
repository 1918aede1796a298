#include "runtime/demo/image/image_file.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "runtime/demo/image/srgb.h"
#include "runtime/demo/image/tone_curve.h"
#include "runtime/images/coded_image.h"
#include "runtime/rays/float3_glm.h"
#include "transfer/file/atomic_file.h"

namespace rebounce {
namespace {

/// Thresholds for dithering, so that slow gradients do not show the steps of eight bits:
/// interleaved gradient noise (J. Jimenez, "Next generation post processing in Call of Duty:
/// Advanced Warfare", 2014). They avoid 0 and 1, so that exact bytes stay unchanged.
float dither_threshold(int x, int y) {
  const float inner = 0.06711056F * static_cast<float>(x) + 0.00583715F * static_cast<float>(y);
  const float noise = 52.9829189F * (inner - std::floor(inner));
  return 0.01F + 0.98F * (noise - std::floor(noise));
}

}  // namespace

ScreenImage tone_map(const Picture& picture) {
  ScreenImage image{.width = picture.width, .height = picture.height};
  image.rgb.reserve(3 * picture.pixel.size());
  const float scale = std::exp2(picture.exposure);
  for (std::size_t k = 0; k < picture.pixel.size(); ++k) {
    const glm::vec3 pixel = to_glm(picture.pixel[k]);
    const glm::vec3 color = picture.display_referred ? pixel : tone_curve(scale * pixel);
    const float threshold = picture.display_referred
                                ? 0.5F
                                : dither_threshold(static_cast<int>(k) % picture.width,
                                                   static_cast<int>(k) / picture.width);
    for (int c = 0; c < kChannelCount; ++c) image.rgb.push_back(to_srgb_byte(color[c], threshold));
  }
  return image;
}

std::vector<std::uint8_t> encode_png(const ScreenImage& image) {
  return encode_png(image.width, image.height, 3, image.rgb);
}

void write_png(const std::filesystem::path& path, const ScreenImage& image) {
  const std::vector<std::uint8_t> bytes = encode_png(image);
  AtomicFile file(path);
  file.write(std::as_bytes(std::span(bytes)));
  file.commit();
}

}  // namespace rebounce

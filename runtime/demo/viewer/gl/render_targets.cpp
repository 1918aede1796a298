#include "runtime/demo/viewer/gl/render_targets.h"

#include <string>
#include <vector>

#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr int kSamples = 4;  // per pixel

// `pictures`: what the bound framebuffer is to hold, in words.
void check_complete(const std::string& pictures) {
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error("viewer: this OpenGL has no " + pictures +
                " or none of this size; ask for a smaller one, or try another driver");
  }
}

}  // namespace

void MultisampledTarget::resize(int width, int height) {
  if (width == width_ && height == height_) return;
  width_ = width;
  height_ = height;
  glBindRenderbuffer(GL_RENDERBUFFER, multisampled_color_.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, GL_RGBA16F, width, height);
  glBindRenderbuffer(GL_RENDERBUFFER, multisampled_depth_.name());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, GL_DEPTH_COMPONENT32F, width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, multisampled_.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                            multisampled_color_.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                            multisampled_depth_.name());
  check_complete("16-bit float pictures of four samples a pixel");
  glBindTexture(GL_TEXTURE_2D, resolved_color_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16F, width, height, 0, GL_RGBA, GL_FLOAT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, resolved_.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D,
                         resolved_color_.name(), 0);
  check_complete("16-bit float pictures");
}

GLuint MultisampledTarget::resolve() const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, multisampled_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_.name());
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  return resolved_color_.name();
}

OffscreenTarget::OffscreenTarget(int width, int height) : width_(width), height_(height) {
  glBindRenderbuffer(GL_RENDERBUFFER, color_.name());
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color_.name());
  check_complete("pictures of 8 bits a channel");
}

ScreenImage OffscreenTarget::read() const {
  ScreenImage image{.width = width_, .height = height_};
  const std::size_t row = 3 * static_cast<std::size_t>(width_);
  std::vector<std::uint8_t> upside_down(row * static_cast<std::size_t>(height_));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE, upside_down.data());
  for (std::size_t y = static_cast<std::size_t>(height_); y-- > 0;) {
    const auto begin = upside_down.begin() + static_cast<std::ptrdiff_t>(y * row);
    image.rgb.insert(image.rgb.end(), begin, begin + static_cast<std::ptrdiff_t>(row));
  }
  return image;
}

}  // namespace rebounce

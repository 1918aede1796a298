#pragma once

#include "runtime/demo/image/images.h"
#include "runtime/demo/viewer/gl/gl_objects.h"

namespace rebounce {

/// A picture of wide range with several samples a pixel.
class MultisampledTarget {
 public:
  /// Throws Error if this OpenGL has no such pictures.
  void resize(int width, int height);
  GLuint framebuffer() const { return multisampled_.name(); }

  /// Takes the mean of each pixel's samples; returns the texture that holds them.
  GLuint resolve() const;

 private:
  int width_ = 0, height_ = 0;
  GlFramebuffer multisampled_, resolved_;
  GlRenderbuffer multisampled_color_, multisampled_depth_;
  GlTexture resolved_color_;
};

/// A picture that is drawn without a window.
class OffscreenTarget {
 public:
  OffscreenTarget(int width, int height);
  GLuint framebuffer() const { return framebuffer_.name(); }
  ScreenImage read() const;

 private:
  int width_, height_;
  GlFramebuffer framebuffer_;
  GlRenderbuffer color_;
};

}  // namespace rebounce

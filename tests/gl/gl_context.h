#pragma once

// OpenGL without a display: a context of EGL, and buffers of light in it.

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "rebounce/error.h"
#include "rebounce/types.h"
#include "runtime/demo/viewer/gl/headless_context.h"
#include "runtime/gpu/gl_functions.h"

namespace rebounce::test {

/// A context of OpenGL 4.3 that is current while it lives, where the machine has one.
class GlContext {
 public:
  GlContext() {
    try {
      context_.emplace();
    } catch (const Error&) {  // there is none
    }
  }

  bool is_current() const { return context_ && context_->has_compute_shaders(); }

 private:
  std::optional<HeadlessContext> context_;
};

/// A second context, which shares the objects of the one that is current when it is made. That one
/// is current again when this ends.
class SharedContext {
 public:
  SharedContext() : display_(eglGetCurrentDisplay()), first_(eglGetCurrentContext()) {
    constexpr std::array<EGLint, 5> kVersion = {EGL_CONTEXT_MAJOR_VERSION, 4,
                                                EGL_CONTEXT_MINOR_VERSION, 3, EGL_NONE};
    second_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, first_, kVersion.data());
  }
  ~SharedContext() {
    use_first();
    eglDestroyContext(display_, second_);
  }
  SharedContext(const SharedContext&) = delete;
  SharedContext& operator=(const SharedContext&) = delete;

  /// Makes it current; false if the machine has none.
  bool use() const { return second_ != EGL_NO_CONTEXT && use(second_); }
  bool use_first() const { return use(first_); }

 private:
  bool use(EGLContext context) const {
    reinterpret_cast<void (*)()>(eglGetProcAddress("glFinish"))();
    return eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE;
  }

  EGLDisplay display_;
  EGLContext first_, second_;
};

/// A buffer of light in the current context.
class LightBuffer {
 public:
  explicit LightBuffer(std::span<const Float3> light) : gl_(eglGetProcAddress) {
    gl_.gen_buffers(1, &name_);
    gl_.bind_buffer(kTarget, name_);
    gl_.buffer_data(kTarget, static_cast<std::ptrdiff_t>(light.size_bytes()), light.data(),
                    Gl::kStaticDraw);
  }
  explicit LightBuffer(std::size_t count) : LightBuffer(std::vector<Float3>(count)) {}
  ~LightBuffer() { gl_.delete_buffers(1, &name_); }
  LightBuffer(const LightBuffer&) = delete;
  LightBuffer& operator=(const LightBuffer&) = delete;

  unsigned name() const { return name_; }

  std::vector<Float3> read() const {
    std::int64_t size = 0;
    gl_.bind_buffer(kTarget, name_);
    gl_.get_buffer_long(kTarget, Gl::kBufferSize, &size);
    std::vector<Float3> light(static_cast<std::size_t>(size) / sizeof(Float3));
    const auto get =
        reinterpret_cast<void (*)(GlFunctions::Enum, std::ptrdiff_t, std::ptrdiff_t, void*)>(
            eglGetProcAddress("glGetBufferSubData"));
    get(kTarget, 0, static_cast<std::ptrdiff_t>(size), light.data());
    return light;
  }

 private:
  static constexpr GlFunctions::Enum kTarget = 0x8F36;  // GL_COPY_READ_BUFFER

  GlFunctions gl_;
  unsigned name_ = 0;
};

}  // namespace rebounce::test

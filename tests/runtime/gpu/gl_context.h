#pragma once

// OpenGL without a display: a context of EGL, and buffers of light in it.

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "rebounce/types.h"
#include "runtime/gpu/gl_functions.h"

namespace rebounce::test {

/// A context of OpenGL 4.3 that is current while it lives, where the machine has one.
class GlContext {
 public:
  GlContext() {
    const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (get_display != nullptr) make(get_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
    if (!is_current_) make(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  }
  ~GlContext() {
    if (!is_current_) return;
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
    eglTerminate(display_);
  }
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  bool is_current() const { return is_current_; }

 private:
  void make(EGLDisplay display) {
    constexpr std::array<EGLint, 7> kWanted = {EGL_CONTEXT_MAJOR_VERSION,
                                               4,
                                               EGL_CONTEXT_MINOR_VERSION,
                                               3,
                                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                               EGL_NONE};
    display_ = display;
    if (display_ == EGL_NO_DISPLAY || eglInitialize(display_, nullptr, nullptr) != EGL_TRUE) return;
    if (eglBindAPI(EGL_OPENGL_API) == EGL_TRUE)
      context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kWanted.data());
    is_current_ = context_ != EGL_NO_CONTEXT &&
                  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE;
    if (!is_current_) eglTerminate(display_);
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  bool is_current_ = false;
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

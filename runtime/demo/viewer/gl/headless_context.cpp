// EGL_MESA_platform_surfaceless, EGL_KHR_no_config_context, EGL_KHR_surfaceless_context.

#include "runtime/demo/viewer/gl/headless_context.h"

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>

#include "rebounce/error.h"

namespace rebounce {
namespace {

EGLDisplay surfaceless_display() {
  const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(  // NOLINT: EGL's way
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display == nullptr) return EGL_NO_DISPLAY;
  return get_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
}

}  // namespace

HeadlessContext::HeadlessContext() {
  display_ = surfaceless_display();
  bool good = display_ != EGL_NO_DISPLAY && eglInitialize(display_, nullptr, nullptr) == EGL_TRUE;
  good = good && eglBindAPI(EGL_OPENGL_API) == EGL_TRUE;
  if (good) {
    for (const EGLint major : {4, 3}) {  // compute shaders, or what pictures need
      const std::array<EGLint, 7> wanted = {EGL_CONTEXT_MAJOR_VERSION,
                                            major,
                                            EGL_CONTEXT_MINOR_VERSION,
                                            3,
                                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                            EGL_NONE};
      context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted.data());
      if (context_ != EGL_NO_CONTEXT) break;
    }
    good = context_ != EGL_NO_CONTEXT &&
           eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE;
  }
  if (good) return;
  if (display_ != EGL_NO_DISPLAY) eglTerminate(display_);
  throw Error(
      "no OpenGL 3.3 without a window here; install Mesa's drivers (libegl-mesa0, "
      "libgl1-mesa-dri), or use render, which needs none");
}

HeadlessContext::~HeadlessContext() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  eglTerminate(display_);
}

}  // namespace rebounce

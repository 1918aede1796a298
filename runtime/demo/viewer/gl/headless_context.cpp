// EGL_EXT_device_enumeration, EGL_EXT_platform_device, EGL_MESA_device_software,
// EGL_MESA_platform_surfaceless, EGL_KHR_no_config_context, EGL_KHR_surfaceless_context.

#include "runtime/demo/viewer/gl/headless_context.h"

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "rebounce/error.h"

namespace rebounce {
namespace {

/// A function of an extension; null if there is none.
template <typename Function>
Function extension(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));  // NOLINT: EGL's way
}

/// All but those that are software.
std::vector<EGLDeviceEXT> graphics_cards() {
  const auto query_devices = extension<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto query_string = extension<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
  EGLint count = 0;
  if (query_devices == nullptr || query_string == nullptr ||
      query_devices(0, nullptr, &count) != EGL_TRUE) {
    return {};
  }
  std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(count));
  if (query_devices(count, devices.data(), &count) != EGL_TRUE) return {};
  devices.resize(static_cast<std::size_t>(count));
  std::erase_if(devices, [&](EGLDeviceEXT device) {
    const char* const extensions = query_string(device, EGL_EXTENSIONS);
    return extensions == nullptr ||
           std::string_view(extensions).find("EGL_MESA_device_software") != std::string_view::npos;
  });
  return devices;
}

/// What may have an OpenGL, the best first.
std::vector<EGLDisplay> displays() {
  std::vector<EGLDisplay> found;
  const auto get_display = extension<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (get_display != nullptr) {
    for (const EGLDeviceEXT card : graphics_cards())
      found.push_back(get_display(EGL_PLATFORM_DEVICE_EXT, card, nullptr));
    found.push_back(get_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
  }
  found.push_back(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  std::erase(found, EGL_NO_DISPLAY);
  return found;
}

EGLContext create_context(EGLDisplay display, EGLint major) {
  const std::array<EGLint, 7> wanted = {EGL_CONTEXT_MAJOR_VERSION,
                                        major,
                                        EGL_CONTEXT_MINOR_VERSION,
                                        3,
                                        EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                        EGL_NONE};
  return eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted.data());
}

}  // namespace

HeadlessContext::HeadlessContext() {
  if (std::ranges::any_of(displays(), [this](EGLDisplay display) { return make(display); })) return;
  throw Error(
      "no OpenGL 3.3 without a window here; install Mesa's drivers (libegl-mesa0, "
      "libgl1-mesa-dri), or use render, which needs none");
}

HeadlessContext::~HeadlessContext() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  eglTerminate(display_);
}

/// Makes a context of `display` current; false, with nothing left of it, if that has none.
bool HeadlessContext::make(void* display) {
  if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return false;
  if (eglBindAPI(EGL_OPENGL_API) == EGL_TRUE) {
    context_ = create_context(display, 4);  // compute shaders
    has_compute_shaders_ = context_ != EGL_NO_CONTEXT;
    if (!has_compute_shaders_) context_ = create_context(display, 3);  // what pictures need
    if (context_ != EGL_NO_CONTEXT &&
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE) {
      display_ = display;
      return true;
    }
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display, context_);
  }
  eglTerminate(display);
  return false;
}

}  // namespace rebounce

#pragma once

namespace rebounce {

/// A context of OpenGL 4.3, or else 3.3, without a window or display, current while the object
/// lives. It uses EGL, with the graphics card or else Mesa's software renderer.
class HeadlessContext {
 public:
  /// Throws Error if this machine has no such OpenGL.
  HeadlessContext();
  ~HeadlessContext();
  HeadlessContext(const HeadlessContext&) = delete;
  HeadlessContext& operator=(const HeadlessContext&) = delete;

 private:
  void* display_ = nullptr;
  void* context_ = nullptr;
};

}  // namespace rebounce

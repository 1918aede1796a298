#pragma once

namespace rebounce {

/// A context of OpenGL 4.3, or else 3.3, without a window or display, current while the object
/// lives. It uses EGL, with the first graphics card that gives one, or else Mesa's software
/// renderer.
class HeadlessContext {
 public:
  /// Throws Error if this machine has no such OpenGL.
  HeadlessContext();
  ~HeadlessContext();
  HeadlessContext(const HeadlessContext&) = delete;
  HeadlessContext& operator=(const HeadlessContext&) = delete;

  /// Whether it has the compute shaders of OpenGL 4.3.
  bool has_compute_shaders() const { return has_compute_shaders_; }

 private:
  bool make(void* display);

  void* display_ = nullptr;
  void* context_ = nullptr;
  bool has_compute_shaders_ = false;
};

}  // namespace rebounce

#pragma once

#include <string>

struct GLFWwindow;

namespace rebounce {

/// A window with an OpenGL 3.3 context, current while the object lives, and Dear ImGui connected to
/// both.
class Window {
 public:
  /// Throws Error if there is no display or no such OpenGL.
  Window(int width, int height, const std::string& title);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Takes in what the user did and begins a frame of ImGui; false once the window is to close.
  bool begin_frame();

  /// Draws what ImGui holds over the picture and shows it.
  void end_frame();

  int width() const { return width_; }    ///< of the picture, in pixels
  int height() const { return height_; }  ///< likewise

 private:
  GLFWwindow* window_ = nullptr;
  int width_ = 0, height_ = 0;
};

}  // namespace rebounce

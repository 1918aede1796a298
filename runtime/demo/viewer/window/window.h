#pragma once

#include <string>

struct GLFWwindow;

namespace rebounce {

/// A window with an OpenGL 3.3 context, current while the object lives, and Dear ImGui connected to
/// both.
class Window {
 public:
  /// Throws Error if there is no display or no OpenGL 3.3.
  Window(int width, int height, const std::string& title);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Reads the user's input and begins a frame of ImGui; false when the window is to close.
  bool begin_frame();

  /// Draws ImGui over the picture and shows both.
  void end_frame();

  int width() const { return width_; }    ///< of the picture, pixels
  int height() const { return height_; }  ///< of the picture, pixels

  /// Whether Mesa draws in software.
  bool draws_on_processor() const;

 private:
  GLFWwindow* window_ = nullptr;
  int width_ = 0, height_ = 0;
};

}  // namespace rebounce

#include "runtime/demo/viewer/window/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <string_view>

#include "rebounce/error.h"
#include "runtime/demo/viewer/gl/gl_objects.h"

namespace rebounce {
namespace {

[[noreturn]] void fail() {
  const char* reason = nullptr;
  glfwGetError(&reason);
  const std::string why = reason != nullptr ? reason : "no OpenGL 3.3";
  glfwTerminate();
  throw Error(
      "cannot open a window (" + why +
      "); run it where there is a display, or write pictures with --screenshot FILE or --out "
      "FOLDER");
}

}  // namespace

Window::Window(int width, int height, const std::string& title) {
  if (glfwInit() != GLFW_TRUE) fail();
  for (const int major : {4, 3}) {  // compute shaders, or what pictures need
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, major);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (window_ != nullptr) break;
  }
  if (window_ == nullptr) fail();
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  glfwGetFramebufferSize(window_, &width_, &height_);
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // writes no settings file
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

bool Window::begin_frame() {
  glfwPollEvents();
  glfwGetFramebufferSize(window_, &width_, &height_);
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  return glfwWindowShouldClose(window_) == GLFW_FALSE;
}

bool Window::draws_on_processor() const {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const std::string_view renderer = name != nullptr ? name : "";
  return renderer.starts_with("llvmpipe") || renderer.starts_with("softpipe");
}

void Window::end_frame() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glfwSwapBuffers(window_);
}

}  // namespace rebounce

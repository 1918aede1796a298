// Lamps and spheres by the mouse alone, through the viewer's controls and without a window.

#include <gtest/gtest.h>
#include <imgui.h>

#include <memory>

#include "runtime/demo/picture/camera.h"
#include "runtime/demo/viewer/window/controls.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_viewer_mouse {
namespace {

// A floor of 4 x 4 m and a ceiling 2 m above it, seen from the side by 400 x 300 pixels.
class ViewerMouse : public testing::Test {
 protected:
  ViewerMouse()
      : scene_(two_planes(), {}, {}),
        controls_(scene_, bounds_),
        state_({.camera = look_at({0, 1, 4}, {0, 1, 0}, 0.9F)}) {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {400, 300};
    unsigned char* texels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsRGBA32(&texels, &width, &height);
    point(0, 0);
  }
  ~ViewerMouse() override { ImGui::DestroyContext(); }

  static std::shared_ptr<TransferData> two_planes() {
    auto data = std::make_shared<TransferData>();
    test::add_square(*data, 2, 0, 3, true, {0.5F, 0.5F, 0.5F});
    test::add_square(*data, 2, 2, 3, false, {0.5F, 0.5F, 0.5F});
    test::add_even_exchange(*data);
    return data;
  }

  void frame() {
    ImGui::GetIO().DeltaTime = 0.1F;
    ImGui::NewFrame();
    controls_.update(state_);
    controls_.draw_menu(state_);
    ImGui::Render();
  }
  // Two frames after each change: menus open and take the mouse in the one that follows.
  void point(float x, float y) {
    ImGui::GetIO().MousePos = {x, y};
    frame();
    frame();
  }
  void hold(ImGuiMouseButton button, bool down) {
    ImGui::GetIO().MouseDown[button] = down;
    frame();
    frame();
  }
  void click(ImGuiMouseButton button) {
    hold(button, true);
    hold(button, false);
  }
  // The entry of the menu at the place (x, y), counted from 0.
  void choose(float x, float y, int entry) {
    point(x, y);
    click(ImGuiMouseButton_Right);
    const ImGuiStyle& style = ImGui::GetStyle();
    const float line = ImGui::GetFontSize() + style.ItemSpacing.y;
    point(x + style.WindowPadding.x + 5,
          y + style.WindowPadding.y + line * (static_cast<float>(entry) + 0.5F));
    click(ImGuiMouseButton_Left);
  }
  // Where a place is in the picture, pixels.
  ImVec2 pixel_of(const Float3& place) const {
    const Camera camera = state_.camera.camera();
    const glm::vec3 way = to_glm(place) - to_glm(camera.position);
    const float depth = -glm::dot(way, to_glm(camera.backward));
    const float scale = 150 / (std::tan(0.45F) * depth);
    return {200 + scale * glm::dot(way, to_glm(camera.right)),
            150 - scale * glm::dot(way, to_glm(camera.up))};
  }

  const SceneBounds bounds_{glm::vec3(-2, 0, -2), glm::vec3(2, 2, 2)};
  const LitScene scene_;
  Controls controls_;
  ViewerState state_;
};

TEST_F(ViewerMouse, AddsLampsInFrontOfTheSurfaceThatIsClickedOn) {
  choose(200, 250, 0);
  choose(250, 60, 0);
  ASSERT_EQ(state_.lights.size(), 2U);
  EXPECT_EQ(state_.selected, 1U);
  const Float3& low = state_.lights[0].light.position;
  EXPECT_NEAR(low[1], 0.15F, 0.01F);  // eye at 1 m, 0.85 of the way to the floor
  EXPECT_NEAR(pixel_of(low).x, 200, 0.5F);
  EXPECT_NEAR(pixel_of(low).y, 250, 0.5F);
  EXPECT_NEAR(state_.lights[1].light.position[1], 1.85F, 0.01F);  // below the ceiling
  EXPECT_GT(state_.lights[0].light.intensity, 0);
}

TEST_F(ViewerMouse, RemovesAndSwitchesTheLampThatIsClickedOn) {
  choose(120, 250, 0);
  choose(280, 250, 0);
  const Float3 left = state_.lights[0].light.position, right = state_.lights[1].light.position;
  choose(280, 250, 1);
  ASSERT_EQ(state_.lights.size(), 2U);
  EXPECT_FALSE(state_.lights[1].on);
  EXPECT_TRUE(state_.lights[0].on);
  choose(120, 250, 0);
  ASSERT_EQ(state_.lights.size(), 1U);
  EXPECT_EQ(state_.lights[0].light.position, right);
  EXPECT_NE(left, right);
}

TEST_F(ViewerMouse, DragsTheLampThatItTakesHoldOf) {
  choose(120, 250, 0);
  choose(280, 250, 0);
  const Float3 other = state_.lights[1].light.position;
  point(120, 250);
  hold(ImGuiMouseButton_Left, true);
  point(150, 200);
  hold(ImGuiMouseButton_Left, false);
  const ImVec2 at = pixel_of(state_.lights[0].light.position);
  EXPECT_NEAR(at.x, 150, 0.5F);
  EXPECT_NEAR(at.y, 200, 0.5F);
  EXPECT_EQ(state_.lights[1].light.position, other);
  EXPECT_EQ(state_.selected, 0U);
}

TEST_F(ViewerMouse, AddsDragsAndRemovesSpheres) {
  choose(120, 250, 1);
  choose(280, 250, 1);
  ASSERT_EQ(state_.spheres.size(), 2U);
  const auto at = [&](std::size_t k) { return pixel_of(state_.spheres[k].position); };
  EXPECT_NEAR(at(1).x, 280, 0.5F);
  EXPECT_GT(state_.spheres[1].position[1], 0);
  point(280, 250);
  hold(ImGuiMouseButton_Left, true);
  point(300, 220);
  hold(ImGuiMouseButton_Left, false);
  EXPECT_NEAR(at(1).x, 300, 0.5F);
  EXPECT_NEAR(at(0).x, 120, 0.5F);
  choose(120, 250, 0);
  ASSERT_EQ(state_.spheres.size(), 1U);
  EXPECT_NEAR(at(0).x, 300, 0.5F);
}

TEST_F(ViewerMouse, ADragWithTheRightButtonOrbitsAndOpensNoMenu) {
  const glm::vec3 before = state_.camera.position();
  point(200, 250);
  hold(ImGuiMouseButton_Right, true);
  point(260, 250);
  hold(ImGuiMouseButton_Right, false);
  EXPECT_GT(glm::distance(state_.camera.position(), before), 0.1F);
  EXPECT_FALSE(ImGui::IsPopupOpen(nullptr, ImGuiPopupFlags_AnyPopup));
}

}  // namespace
}  // namespace rebounce::test_viewer_mouse

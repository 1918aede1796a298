// Lamps and spheres by the mouse and the panel, through the viewer's controls and without a window.

#include <gtest/gtest.h>
#include <imgui.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "runtime/demo/picture/camera.h"
#include "runtime/demo/viewer/window/controls.h"
#include "runtime/demo/viewer/window/panels.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/light_sampling.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_viewer_mouse {
namespace {

// ImGui without a window, and a mouse.
class WithMouse : public testing::Test {
 protected:
  explicit WithMouse(const ImVec2& size) {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = size;
    io.MousePos = {0, 0};
    unsigned char* texels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsRGBA32(&texels, &width, &height);
  }
  ~WithMouse() override { ImGui::DestroyContext(); }

  virtual void draw() = 0;

  void frame() {
    ImGui::GetIO().DeltaTime = 0.1F;
    ImGui::NewFrame();
    draw();
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
};

// A floor of 4 x 4 m and a ceiling 2 m above it, seen from the side by 400 x 300 pixels.
class ViewerMouse : public WithMouse {
 protected:
  ViewerMouse()
      : WithMouse({400, 300}),
        scene_(two_planes(), {}, {}),
        controls_(scene_, bounds_),
        state_({.camera = look_at({0, 1, 4}, {0, 1, 0}, 0.9F)}) {
    point(0, 0);
  }

  static std::shared_ptr<TransferData> two_planes() {
    auto data = std::make_shared<TransferData>();
    test::add_square(*data, 2, 0, 3, true, {0.5F, 0.5F, 0.5F});
    test::add_square(*data, 2, 2, 3, false, {0.5F, 0.5F, 0.5F});
    test::add_even_exchange(*data);
    return data;
  }

  void draw() override {
    controls_.update(state_);
    controls_.draw_menu(state_);
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

TEST_F(ViewerMouse, TakesNoHoldOfHiddenDiscs) {
  choose(120, 250, 0);
  const Float3 place = state_.lights[0].light.position;
  state_.shows_panels = false;
  const glm::vec3 ahead = state_.camera.forward();
  point(120, 250);
  hold(ImGuiMouseButton_Left, true);
  point(150, 200);
  hold(ImGuiMouseButton_Left, false);
  EXPECT_EQ(state_.lights[0].light.position, place);
  EXPECT_GT(glm::distance(state_.camera.forward(), ahead), 0.01F);
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

// The controls of one lamp in a panel of 390 x 490 pixels.
class LampPanel : public WithMouse {
 protected:
  LampPanel() : WithMouse({400, 500}), camera_(look_at({0, 1, 4}, {0, 1, 0}, 0.9F)) {
    ImGui::GetIO().KeyMap[ImGuiKey_Enter] = kEnter;
    point(395, 495);
  }

  void draw() override {
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({390, 490});
    ImGui::Begin("lamp");
    edit_lamp(lamp_, camera_, 4);
    ImGui::End();
  }
  // Gives every line of the panel this text, in its leftmost field.
  void type_everywhere(const char* text) {
    ImGuiIO& io = ImGui::GetIO();
    for (float y = 25; y < 480; y += 8) {
      point(20, y);
      io.KeyCtrl = true;
      click(ImGuiMouseButton_Left);
      io.KeyCtrl = false;
      io.AddInputCharactersUTF8(text);
      frame();
      io.KeysDown[kEnter] = true;
      frame();
      io.KeysDown[kEnter] = false;
      // Closes the list of types or motions.
      point(395, 495);
      click(ImGuiMouseButton_Left);
    }
  }

  static constexpr int kEnter = 257;
  ViewerLight lamp_;
  FlyCamera camera_;
};

TEST_F(LampPanel, WhatIsTypedInStaysWithinWhatAFrameTakes) {
  using Kind = LightMotion::Kind;
  for (const LampKind* kind : lamp_kinds()) {
    for (const Kind motion : {Kind::kStill, Kind::kCircle, Kind::kSwing}) {
      lamp_ = {};
      change_type(lamp_.light, kind->type, 4);
      lamp_.motion.kind = motion;
      for (const char* text : {"1e39", "-1e39"}) {
        type_everywhere(text);
        const Light now = moved(lamp_.light, lamp_.motion, 1);
        EXPECT_NO_THROW(check_light(now)) << kind->name << ' ' << text;
        EXPECT_TRUE(std::isfinite(lamp_.light.color[0] * lamp_.light.intensity)) << kind->name;
      }
      ASSERT_EQ(lamp_.light.type, kind->type);
      ASSERT_EQ(lamp_.motion.kind, motion);
      EXPECT_EQ(lamp_.light.color[0], 0);
      if (!kind->has_place()) continue;
      const Float3& typed = motion == Kind::kStill    ? lamp_.light.position
                            : motion == Kind::kCircle ? lamp_.motion.center
                                                      : lamp_.motion.to;
      EXPECT_EQ(typed[0], -1e9F) << kind->name;
    }
  }
}

TEST_F(LampPanel, ShowingASpotLeavesItsCones) {
  lamp_.light.type = LightType::kSpot;
  for (const float angle : {0.005F, 0.3F}) {
    lamp_.light.inner_cone_angle = lamp_.light.outer_cone_angle = angle;
    frame();
    EXPECT_EQ(lamp_.light.inner_cone_angle, angle);
    EXPECT_EQ(lamp_.light.outer_cone_angle, angle);
  }
}

TEST_F(LampPanel, WhatKeysGiveIsNotEdited) {
  lamp_.light.type = LightType::kSpot;
  lamp_.motion = {.kind = LightMotion::Kind::kKeys, .keys = {{}}};
  const Light before = lamp_.light;
  type_everywhere("7");
  EXPECT_EQ(lamp_.light.color, before.color);
  EXPECT_EQ(lamp_.light.intensity, before.intensity);
  EXPECT_EQ(lamp_.light.direction, before.direction);
  EXPECT_NE(lamp_.light.outer_cone_angle, before.outer_cone_angle);
}

TEST(LampTypes, AProfileGoesWhereTheTypeHasNone) {
  const auto profile = std::make_shared<const IntensityProfile>(IntensityProfile{
      .vertical = {0, std::numbers::pi_v<float>}, .horizontal = {0}, .candela = {50, 50}});
  Light light;
  light.intensity = 2;
  light.profile = profile;
  change_type(light, LightType::kSpot, 4);
  EXPECT_EQ(light.profile, profile);
  EXPECT_EQ(light.intensity, 2);
  change_type(light, LightType::kDisc, 4);
  EXPECT_EQ(light.profile, nullptr);
  EXPECT_NEAR(lamp_kind(light.type).surface->candela(PreparedLight(light)) * light.intensity, 100,
              0.01F);  // sums of floats
}

}  // namespace
}  // namespace rebounce::test_viewer_mouse

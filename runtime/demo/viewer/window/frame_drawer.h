#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/demo/viewer/gl/card_light.h"
#include "runtime/demo/viewer/gl/gpu_scene.h"
#include "runtime/demo/viewer/gl/scene_renderer.h"
#include "runtime/demo/viewer/window/lit_scene.h"
#include "runtime/demo/viewer/window/viewer_state.h"

namespace rebounce {

/// Draws frames, from light to picture. Needs a current OpenGL context.
class FrameDrawer {
 public:
  FrameDrawer(const std::shared_ptr<const TransferData>& data, const ViewerSetup& setup);

  /// Relights and draws `state` into `framebuffer`. Where the graphics card refuses the scene, its
  /// sides become those of the processor, and card_refusal() tells why.
  void draw(ViewerState& state, int width, int height, GLuint framebuffer);

  const StageTimes& times() const { return times_; }
  const LitScene& scene() const { return lit_; }
  /// Whether frames may be on the graphics card.
  bool has_card() const { return has_card_; }
  /// Why the graphics card refuses, in one line; empty: it does not, or was not asked.
  const std::string& card_refusal() const { return card_refusal_; }
  const SceneBounds& bounds() const { return renderer_.bounds(); }

  /// The largest shown error of a patch (LitScene::patch_errors); 0 without errors.
  float error_top() const { return error_top_; }

 private:
  /// Makes card_ if a side is on the card and there is none yet.
  void make_card(ViewerState& state);
  void upload(const ViewerState& state);
  /// Lights the sides that are on the card.
  void relight_on_card(const ViewerState& state, std::span<const Light> lights);
  void compare(const ViewerState& state);
  BodyMesh make_spheres(std::span<const ViewerSphere> spheres, const ViewerState& state);
  void upload_errors();

  std::shared_ptr<const TransferData> data_;
  LitScene lit_;
  GpuScene gpu_;
  SceneRenderer renderer_;
  std::unique_ptr<CardLight> card_;  // made when it is first asked for
  bool has_card_;
  std::string card_refusal_;
  std::vector<Float3> others_;  // direct light of the processor for the card
  StageTimes times_;
  std::vector<ViewerSphere> spheres_;                       // of the last frame
  std::array<std::vector<float>, kSideCount> patch_error_;  // empty: not shown
  float error_top_ = 0;                                     // at the top of the colour map
};

}  // namespace rebounce

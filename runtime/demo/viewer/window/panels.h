#pragma once

#include "runtime/demo/viewer/window/frame_drawer.h"
#include "runtime/demo/viewer/window/viewer_state.h"

namespace rebounce {

/// Draws the viewer's panels with ImGui and applies the user's changes.
class Panels {
 public:
  void draw(ViewerState& state, const FrameDrawer& frame);

 private:
  void smooth(const StageTimes& times);
  void draw_view(ViewerState& state, const FrameDrawer& frame) const;
  void draw_methods(ViewerState& state, const FrameDrawer& frame) const;
  void draw_times(const ViewerState& state) const;
  void draw_lights(ViewerState& state, const FrameDrawer& frame) const;
  void draw_spheres(ViewerState& state, const FrameDrawer& frame) const;

  StageTimes smoothed_;
  int frame_ = 0;
};

/// Draws the controls of a lamp in a scene of `size` metres and applies the user's changes, within
/// what a frame takes.
void edit_lamp(ViewerLight& lamp, const FlyCamera& camera, float size);

/// Makes a lamp of another type of `light`, as bright where both have a place. Lengths that it
/// lacks suit a scene of `size` metres; a profile goes where the type has none.
void change_type(Light& light, LightType type, float size);

}  // namespace rebounce

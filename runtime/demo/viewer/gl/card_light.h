#pragma once

#include <memory>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/demo/viewer/gl/gl_objects.h"

namespace rebounce {

/// The light of a frame by the graphics card alone: from the shadow maps of the viewer to its
/// vertices. Needs a current context of OpenGL 4.3.
class CardLight {
 public:
  /// Throws Error as GpuEngine does.
  explicit CardLight(const std::shared_ptr<const TransferData>& data);
  CardLight(const CardLight&) = delete;
  CardLight& operator=(const CardLight&) = delete;

  /// Whether the current context and the operator of `data` allow it.
  static bool is_possible(const TransferData& data);
  /// Whether the card finds the direct light of `light` itself.
  static bool can_light(const Light& light);

  /// Writes the light at the vertices [v] in lx that `lamps` and `others` make the patches reflect
  /// to the buffer `bounced`. Others are a direct irradiance [n] in lx, that of emitters too: what
  /// these give directly is shown as direct light.
  void relight(std::span<const GpuLamp> lamps, std::span<const Float3> others, GLuint bounced);

  /// Microseconds of the last frame by stage.
  std::vector<GpuStageTime> stage_times() const { return engine_.stage_times(); }

 private:
  GpuEngine engine_;
  GlBuffer others_, direct_;
};

}  // namespace rebounce

#pragma once

#include <glm/glm.hpp>
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
  /// `emitted_at_vertices` [v] in lx or none: what arrives there directly from emitters, which the
  /// viewer shows as direct light. Throws Error as GpuEngine does.
  CardLight(const std::shared_ptr<const TransferData>& data,
            std::span<const glm::vec3> emitted_at_vertices);
  ~CardLight();
  CardLight(const CardLight&) = delete;
  CardLight& operator=(const CardLight&) = delete;

  /// Whether the current context and the operator of `data` allow it.
  static bool is_possible(const TransferData& data);
  /// Whether the card finds the direct light of `light` itself.
  static bool can_light(const Light& light);

  /// Writes the bounced light at the vertices [v] in lx, without that of emitters, to the buffer
  /// `bounced`: of `lamps`, and of `others`, a direct irradiance [n] in lx.
  void relight(std::span<const GpuLamp> lamps, std::span<const Float3> others, GLuint bounced);

  /// Microseconds of the last frame by stage.
  std::vector<GpuStageTime> stage_times() const { return engine_.stage_times(); }
  std::size_t bytes() const { return engine_.bytes(); }

 private:
  GpuEngine engine_;
  std::size_t value_count_ = 0;  ///< three for each vertex; 0: nothing emits
  GlBuffer others_, direct_, emitted_;
  GLuint subtract_ = 0;
};

}  // namespace rebounce

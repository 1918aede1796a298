#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/sky.h"
#include "runtime/demo/motion/indirect_solver.h"
#include "runtime/demo/shading/emitting_rectangles.h"
#include "runtime/demo/viewer/gl/gpu_scene.h"
#include "runtime/demo/viewer/window/viewer_setup.h"

namespace rebounce {

/// Irradiance in lx at a point in the air, on surfaces with given normals.
struct LightInAir {
  std::vector<Float3> first_flight;  ///< directly from sky and emitters
  std::array<std::vector<Float3>, kSideCount> bounced;
};

/// The light of a frame on the patches, by two methods.
class LitScene {
 public:
  using Reference = decltype(ViewerSetup::reference);

  using MakeProbes = decltype(ViewerSetup::make_probes);

  /// `data` must have an operator. `reference` and `make_probes` may be empty.
  LitScene(std::shared_ptr<const TransferData> data, Reference reference, MakeProbes make_probes);

  /// Computes direct light, and indirect light by `methods`, the second only if `both`; those that
  /// are on the graphics card only if `patches_of_card`. Adds to `times.direct` and sets
  /// `times.solve`.
  void relight(std::span<const Light> lights, const Sky& sky,
               std::span<const IndirectMethod, kSideCount> methods, bool both, bool patches_of_card,
               StageTimes& times);

  /// The direct irradiance [n] in lx of `lights` and `sky` by shadow rays; valid until the next
  /// call. Lamps of intensity 0 cost nothing. Adds to `times.direct`.
  std::span<const Float3> direct_light(std::span<const Light> lights, const Sky& sky,
                                       StageTimes& times);

  /// Emitting surface that a picture may draw as lamps.
  std::span<const Light> emitter_lamps() const { return rectangles_.lamps; }

  /// F M_e [n] in lx, what arrives directly from emitters; empty if there are none.
  std::span<const Float3> emitted_irradiance() const { return emitted_; }

  /// H [n] in lx of the last frame.
  std::span<const Float3> indirect(Side side) const { return indirect_[index(side)]; }

  /// The direct light of sky and emitters at the vertices [v], lx; without that of emitter_lamps()
  /// if these are drawn.
  std::vector<glm::vec3> first_flight_at_vertices(const Sky& sky, bool draws_emitter_lamps) const;
  std::vector<glm::vec3> bounced_at_vertices(Side side) const;

  /// The irradiance at `position` on surfaces with these unit normals, from the probes around it
  /// and the last frame, without lamps. The second side is zero unless `both`. Computes probes
  /// first if the file has none.
  LightInAir light_in_air(const Float3& position, std::span<const Float3> normals, const Sky& sky,
                          bool both);

  /// Compares a side with the reference solution for the same direct light; computes that again if
  /// the light has changed. Returns |H - reference| of each patch [n], relative to the reference's
  /// root mean square; nothing without a reference.
  std::vector<float> patch_errors(Side side);

  /// |H - reference| / |reference| of the last patch_errors of that side, area-weighted L2.
  double error(Side side) const { return error_[index(side)]; }
  bool has_reference() const { return static_cast<bool>(reference_); }

  /// exposure_for() of what `camera` sees; of all light where `show` is not a kind of light.
  float find_exposure(std::span<const Light> lights, const Sky& sky, const Camera& camera,
                      Show show) const;

  const Engine& engine() const { return engine_; }
  const TransferData& data() const { return *data_; }

 private:
  static std::size_t index(Side side) { return static_cast<std::size_t>(side); }
  const LightProbes& probes();
  std::vector<Float3> light_of_other_emitters();

  std::shared_ptr<const TransferData> data_;
  Engine engine_;
  std::vector<Float3> emitted_;  // F M_e, lx, or none
  EmittingRectangles rectangles_;
  std::vector<Float3> other_emitted_;  // of what is no rectangle, lx, or none
  std::array<IndirectSolver, kSideCount> solver_;
  std::array<std::vector<Float3>, kSideCount> indirect_;
  std::array<std::vector<Float3>, kSideCount> reflected_;  // B - M_e, lx
  std::array<double, kSideCount> error_ = {};
  PictureRenderer pictures_;
  Reference reference_;
  MakeProbes make_probes_;
  std::optional<LightProbes> own_probes_;                        // if the file has none
  std::vector<Float3> reference_exitance_, reference_indirect_;  // of the last computed reference
};

}  // namespace rebounce

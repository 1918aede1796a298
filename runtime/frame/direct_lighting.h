#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/frame/direct_lighting_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/base/parallel.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Direct irradiance of the patches of one scene, with shadows.
///
/// Points of the patches and places on the lamps are chosen once and stay where they are, so that a
/// light that moves does not flicker. What each light of a frame does at intensity 1 is kept, by
/// its number among the lights: only lights that have moved or changed shape since the last frame
/// are traced again, and those of another intensity or colour are not. Results depend on the lights
/// alone, not on those before.
///
/// One object per thread that lights; copies share the points.
class DirectLighting {
 public:
  /// `data` and `tracer` (the first surface_count triangles of data.mesh) must outlive the object
  /// and its copies. Throws Error if a setting is out of range.
  DirectLighting(const TransferData& data, const RayTracer& tracer,
                 const DirectLightingSettings& settings = {});
  ~DirectLighting();
  DirectLighting(const DirectLighting&);
  DirectLighting& operator=(const DirectLighting&) = delete;

  /// Writes the irradiance [n] in lx that arrives straight from `lights` and `sky`. Does not
  /// allocate, but see light_capacity. The same bits for any `scheduler`. Throws Error as check_sky
  /// does.
  void compute(std::span<const Light> lights, const Sky& sky, std::span<Float3> direct_irradiance,
               const Scheduler& scheduler = {});

  /// Lights that the last compute() traced: those that were new or had changed.
  int traced_light_count() const { return traced_light_count_; }

 private:
  struct Receivers;
  struct LightResponse;

  static std::shared_ptr<const Receivers> spread_receivers(const TransferData& data,
                                                           const RayTracer& tracer,
                                                           const DirectLightingSettings& settings);
  void make_room(std::size_t light_count);
  void prepare(std::span<const Light> lights);
  void respond(LightResponse& response, std::size_t block) const;
  void add_up(const Sky& sky, std::size_t block, std::span<Float3> direct_irradiance) const;

  const TransferData& data_;
  const RayTracer& tracer_;
  std::shared_ptr<const Receivers> receivers_;
  std::vector<LightResponse> responses_;
  std::size_t light_count_ = 0;  ///< of the present frame; no more than there are responses
  int traced_light_count_ = 0;
};

}  // namespace rebounce

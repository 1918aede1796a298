#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/sky.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/base/parallel.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

struct OccluderGroups;
struct Receivers;

/// How shadows are found.
enum class ShadowMethod : std::uint8_t {
  kVolumes,  ///< by the shadow volumes of flat pieces of surface, and by rays where those do not
             ///< tell
  kRays,     ///< by rays from all points: what kVolumes is compared with
};

/// Direct irradiance of the patches of one scene, with shadows.
///
/// The points on patches and on lamps are chosen once, so a moving light does not flicker. The
/// irradiance of each light at intensity 1 is kept under the light's number. Only lights that have
/// moved or changed shape since the last frame are traced again; a change of intensity or colour
/// needs no tracing. Results depend only on the current lights.
///
/// Use one object per thread; copies share the points.
class DirectLighting {
 public:
  /// `data` and `tracer` (over the first surface_count triangles of data.mesh) must outlive the
  /// object and its copies. Throws Error if a setting is out of range.
  DirectLighting(const TransferData& data, const RayTracer& tracer,
                 const DirectLightingSettings& settings = {},
                 ShadowMethod method = ShadowMethod::kVolumes);
  ~DirectLighting();
  DirectLighting(const DirectLighting&);
  DirectLighting& operator=(const DirectLighting&) = delete;

  /// Writes the irradiance [n] in lx that arrives directly from `lights` and `sky`. Does not
  /// allocate, except as light_capacity describes. Gives the same bits for any `scheduler`. Throws
  /// Error as check_sky does.
  void compute(std::span<const Light> lights, const Sky& sky, std::span<Float3> direct_irradiance,
               const Scheduler& scheduler = {});

  /// The number of that light of the last compute(), of one or more, which gives most to a patch.
  std::size_t strongest_light(std::size_t patch) const;

  /// The number of lights that the last compute() traced: new and changed ones.
  int traced_light_count() const { return traced_light_count_; }

 private:
  struct LightResponse;

  void make_room(std::size_t light_count);
  void prepare(std::span<const Light> lights);
  void respond(LightResponse& response, std::size_t block) const;
  void add_up(const Sky& sky, std::size_t block, std::span<Float3> direct_irradiance) const;

  const TransferData& data_;
  const RayTracer& tracer_;
  std::shared_ptr<const Receivers> receivers_;
  std::shared_ptr<const OccluderGroups> occluders_;
  std::vector<LightResponse> responses_;
  std::size_t light_count_ = 0;  ///< of the current frame; at most the number of responses
  int traced_light_count_ = 0;
};

}  // namespace rebounce

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/frame/direct_lighting_settings.h"
#if REBOUNCE_WITH_EMBREE
#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/ray_tracer.h"
#endif
#include "transfer/base/parallel.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

struct EngineSettings {
  DirectLightingSettings direct_lighting{};  ///< of no use where the caller brings the direct light
  Scheduler scheduler{};                     ///< where frames run; copies of the engine use it too
};

/// Relights one scene: direct light, then one product with the stored operator.
///
/// Where that has receivers and sources (TransferOperator::roles of data().transfer), the indirect
/// irradiance of all other patches than receivers is 0, and their radiosity what they give off the
/// first time; light on patches that are no sources is shown as direct light and never bounces.
///
/// The transfer data are read only and may be shared by any number of engines; an engine is one
/// light state and belongs to one thread at a time. A copy shares the data, the ray tracer and the
/// points of the patches and has a light state of its own: that is how many threads relight one
/// scene. After construction nothing allocates, locks, prints or touches a file, but see
/// DirectLightingSettings::light_capacity.
///
/// Where the library is built without Embree (REBOUNCE_WITH_EMBREE is 0), the caller brings the
/// direct irradiance.
class Engine {
 public:
  /// Makes room for everything a frame needs. Throws Error if `data` has no operator or a setting
  /// is out of range.
  explicit Engine(std::shared_ptr<const TransferData> data, const EngineSettings& settings = {});

#if REBOUNCE_WITH_EMBREE
  /// One frame: finds the direct irradiance of the patches under `lights` and `sky`, and with it
  /// all that follows. Lights are known by their number: keep their order (direct_lighting.h).
  void relight(std::span<const Light> lights, const Sky& sky);

  /// The first stage of it.
  void compute_direct(std::span<const Light> lights, const Sky& sky);

  const RayTracer& tracer() const {
    return *tracer_;
  }
  const DirectLighting& direct_lighting() const {
    return direct_lighting_;
  }
#endif

  /// One frame with a direct irradiance [n] in lx that the caller brings, from shadow maps for
  /// instance. Throws Error if the size is wrong.
  void relight(std::span<const Float3> direct_irradiance);

  // The stages that follow the direct light, for those who time or replace one.
  void compute_initial_exitance();
  void apply_transfer();
  void compute_radiosity();

  /// From the next frame on, what the surfaces of material `material` emit is that of the scene
  /// times `scale`, each channel >= 0. Throws Error if there is no such material or `scale` is
  /// negative or not finite. A patch of several materials follows the one that emits from most of
  /// it.
  void set_emission_scale(std::uint32_t material, const Float3& scale);

  // Results, [n] in lx; valid until the next frame.
  std::span<const Float3> direct_irradiance() const {
    return direct_irradiance_;
  }
  std::span<const Float3> initial_exitance() const {
    return initial_exitance_;
  }
  std::span<const Float3> indirect_irradiance() const {
    return indirect_irradiance_;
  }
  std::span<const Float3> radiosity() const {
    return radiosity_;
  }
  /// What the patches emit at present.
  std::span<const Float3> emitted_exitance() const {
    return emitted_exitance_;
  }

  const TransferData& data() const {
    return *data_;
  }
  const std::shared_ptr<const TransferData>& shared_data() const {
    return data_;
  }
  /// Where frames run, for the outputs too.
  const Scheduler& scheduler() const {
    return scheduler_;
  }

 private:
  void make_room();

  std::shared_ptr<const TransferData> data_;
  Scheduler scheduler_;
#if REBOUNCE_WITH_EMBREE
  std::shared_ptr<const RayTracer> tracer_;
  DirectLighting direct_lighting_;
#endif
  std::shared_ptr<const std::vector<std::uint32_t>> emitting_material_;  ///< [n]
  std::vector<Float3> emitted_exitance_;
  std::vector<Float3> direct_irradiance_, initial_exitance_, indirect_irradiance_, radiosity_;
  std::vector<float> workspace_;
};

}  // namespace rebounce

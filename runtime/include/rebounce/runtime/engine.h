#pragma once

#include <memory>
#include <span>
#include <vector>

#include "rebounce/runtime/direct_lighting.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// Relights one scene: direct light, then one product with the stored operator.
///
/// The transfer data are read only and may be shared by any number of engines; an engine is one
/// light state and belongs to one thread at a time. After construction nothing allocates, locks,
/// prints or touches a file.
class Engine {
 public:
  /// Makes room for everything a frame needs. `data` must have an operator.
  explicit Engine(std::shared_ptr<const TransferData> data,
                  const DirectLightingSettings& settings = {});

  /// One frame: finds the direct irradiance of the patches under `lights` and `sky`, and with it
  /// all that follows.
  void relight(std::span<const Light> lights, const Sky& sky);

  /// The same with a direct irradiance [n] in lx that the caller brings, from shadow maps for
  /// instance. Throws Error if the size is wrong.
  void relight(std::span<const Float3> direct_irradiance);

  /// The stages of relight, for those who time or replace one.
  void compute_direct(std::span<const Light> lights, const Sky& sky);
  void compute_initial_exitance();
  void apply_transfer();
  void compute_radiosity();

  // Results, [n] in lx; valid until the next frame.
  std::span<const Float3> direct_irradiance() const { return direct_irradiance_; }
  std::span<const Float3> initial_exitance() const { return initial_exitance_; }
  std::span<const Float3> indirect_irradiance() const { return indirect_irradiance_; }
  std::span<const Float3> radiosity() const { return radiosity_; }

  const TransferData& data() const { return *data_; }
  const RayTracer& tracer() const { return tracer_; }

 private:
  std::shared_ptr<const TransferData> data_;
  RayTracer tracer_;
  DirectLighting direct_lighting_;
  std::vector<Float3> direct_irradiance_, initial_exitance_, indirect_irradiance_, radiosity_;
  std::vector<float> workspace_;
};

}  // namespace rebounce

#pragma once

// What an engine is made of, for those who time, replace or look into a stage of a frame.

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/outputs/surface_light.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/receiver_products.h"

namespace rebounce {

/// Whether a thread is at work in an engine. That of a copy is its own.
struct EngineUse {
  std::atomic<bool> busy = false;

  EngineUse() = default;
  EngineUse(const EngineUse& /*other*/) {}
  EngineUse& operator=(const EngineUse&) = delete;
};

/// A call that changes an engine. Throws Error if another thread is in one: two at once would mix
/// their light states silently.
class OneThread {
 public:
  explicit OneThread(EngineUse& use);
  ~OneThread();
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  EngineUse& use_;
};

/// Throws Error with the number of the first light that has a field out of its range.
void check_lights(std::span<const Light> lights);

struct Engine::Parts {
  Parts(std::shared_ptr<const TransferData> transfer_data, const EngineSettings& settings);
  Parts(const Parts& other);
  Parts& operator=(const Parts&) = delete;

  // The stages of a frame. `lights` are within their ranges; the first stage throws as check_sky
  // does, and if more light arrives at a patch than a frame can take. Nothing has changed then.
  void compute_direct(std::span<const Light> lights, const Sky& frame_sky);
  void compute_initial_exitance();
  void apply_transfer();
  void compute_radiosity();

  mutable EngineUse use;
  std::shared_ptr<const TransferData> data;
  Scheduler scheduler;
  std::shared_ptr<const RayTracer> tracer;
  std::shared_ptr<DirectLighting> direct_lighting;                      ///< of this engine alone
  std::shared_ptr<const std::vector<std::uint32_t>> emitting_material;  ///< [n]
  Sky sky;                                                              ///< of the last frame
  std::vector<Float3> emitted_exitance;
  std::vector<Float3> direct_irradiance, initial_exitance, indirect_irradiance, radiosity;
  std::vector<Float3> arriving;  ///< direct irradiance of a frame that may be refused
  std::vector<float> workspace;

  // What outputs of a frame (outputs.h) need to be made.
  std::vector<Float3> vertex_irradiance;  ///< [v] if there is a lightmap
  std::vector<SurfaceLight> patch_light;  ///< [n] if there are surface harmonics
  mutable ReceiverProducts receiver_products;
  ReceiverProducts texel_products;
};

}  // namespace rebounce

#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/gpu/gl_resources.h"

namespace rebounce {

/// Direct light at the points of patches, with the shadow maps of the caller.
class GpuDirectLight {
 public:
  /// Takes receiver_points() to the card.
  GpuDirectLight(const std::shared_ptr<const GlFunctions>& gl, const TransferData& data,
                 const DirectLightingSettings& settings);
  ~GpuDirectLight();
  GpuDirectLight(const GpuDirectLight&) = delete;
  GpuDirectLight& operator=(const GpuDirectLight&) = delete;

  std::size_t bytes() const;

  /// Throws Error with the number of the first lamp that run() cannot light. Textures at the
  /// bindings that GlTextureGuard keeps change.
  void check(std::span<const GpuLamp> lamps) const;

  /// As GpuEngine::light_patches, with lamps that check() accepts and buffers that fit. Program,
  /// buffers and textures at the bindings that GlStateGuard and GlTextureGuard keep change.
  void run(std::span<const GpuLamp> lamps, unsigned others, unsigned direct_irradiance);

 private:
  bool bind_to_look(const GpuLamp& lamp) const;
  void check_texture(std::size_t number, const GpuLamp& lamp) const;
  void bind_texture(const GpuLamp& lamp, std::size_t slot) const;

  std::shared_ptr<const GlFunctions> gl_;
  std::size_t patch_count_, points_per_patch_;
  ComputeProgram program_;
  StorageBuffer points_, runs_;
  StorageBuffer of_runs_;              ///< [run][patch][3], of runs that do not wait for each other
  unsigned samplers_[2] = {0, 0};      ///< for depth that grows with distance, and that falls
  std::vector<unsigned char> blocks_;  ///< of the runs of a frame, as `runs_` takes them
};

}  // namespace rebounce

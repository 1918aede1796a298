#include "rebounce/runtime/engine.h"

#include <algorithm>

#include "rebounce/transfer/error.h"

namespace rebounce {

Engine::Engine(std::shared_ptr<const TransferData> data, const DirectLightingSettings& settings)
    : data_(std::move(data)),
      tracer_(make_surface_tracer(data_->mesh)),
      direct_lighting_(*data_, tracer_, settings) {
  if (!data_->transfer) throw Error("the transfer data have no operator");
  const std::size_t n = data_->patches.size();
  direct_irradiance_.resize(n);
  initial_exitance_.resize(n);
  indirect_irradiance_.resize(n);
  radiosity_.resize(n);
  workspace_.resize(data_->transfer->workspace_size());
}

void Engine::relight(std::span<const Light> lights, const Sky& sky) {
  compute_direct(lights, sky);
  compute_initial_exitance();
  apply_transfer();
  compute_radiosity();
}

void Engine::relight(std::span<const Float3> direct_irradiance) {
  if (direct_irradiance.size() != direct_irradiance_.size()) {
    throw Error("direct irradiance must have one entry per patch");
  }
  std::ranges::copy(direct_irradiance, direct_irradiance_.begin());
  compute_initial_exitance();
  apply_transfer();
  compute_radiosity();
}

void Engine::compute_direct(std::span<const Light> lights, const Sky& sky) {
  direct_lighting_.compute(lights, sky, direct_irradiance_);
}

void Engine::compute_initial_exitance() {
  const PatchTable& patches = data_->patches;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      initial_exitance_[i][c] =
          patches.reflectance[i][c] * direct_irradiance_[i][c] + patches.emitted_exitance[i][c];
    }
  }
}

void Engine::apply_transfer() {
  data_->transfer->apply(initial_exitance_, indirect_irradiance_, workspace_);
}

void Engine::compute_radiosity() {
  const PatchTable& patches = data_->patches;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      radiosity_[i][c] =
          initial_exitance_[i][c] + patches.reflectance[i][c] * indirect_irradiance_[i][c];
    }
  }
}

}  // namespace rebounce

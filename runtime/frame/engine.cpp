#include "runtime/frame/engine.h"

#include <algorithm>
#include <cmath>

#include "runtime/lights/emitting_material.h"
#include "transfer/base/error.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

std::shared_ptr<const TransferData> checked(std::shared_ptr<const TransferData> data) {
  if (!data || !data->transfer) throw Error("the transfer data have no operator");
  return data;
}

}  // namespace

#if REBOUNCE_WITH_EMBREE
Engine::Engine(std::shared_ptr<const TransferData> data, const EngineSettings& settings)
    : data_(checked(std::move(data))),
      scheduler_(settings.scheduler),
      tracer_(std::make_shared<const RayTracer>(make_surface_tracer(data_->mesh))),
      direct_lighting_(*data_, *tracer_, settings.direct_lighting) {
  make_room();
}

void Engine::relight(std::span<const Light> lights, const Sky& sky) {
  compute_direct(lights, sky);
  compute_initial_exitance();
  apply_transfer();
  compute_radiosity();
}

void Engine::compute_direct(std::span<const Light> lights, const Sky& sky) {
  direct_lighting_.compute(lights, sky, direct_irradiance_, scheduler_);
}
#else
Engine::Engine(std::shared_ptr<const TransferData> data, const EngineSettings& settings)
    : data_(checked(std::move(data))), scheduler_(settings.scheduler) {
  make_room();
}
#endif

void Engine::make_room() {
  const std::size_t n = data_->patches.size();
  emitting_material_ =
      std::make_shared<const std::vector<std::uint32_t>>(find_emitting_material(*data_));
  emitted_exitance_ = data_->patches.emitted_exitance;
  direct_irradiance_.resize(n);
  initial_exitance_.resize(n);
  indirect_irradiance_.resize(n);
  radiosity_.resize(n);
  workspace_.resize(data_->transfer->workspace_size());
}

void Engine::relight(std::span<const Float3> direct_irradiance) {
  if (direct_irradiance.size() != direct_irradiance_.size()) {
    throw Error("direct irradiance must have one entry per patch: " +
                std::to_string(direct_irradiance_.size()) + ", not " +
                std::to_string(direct_irradiance.size()));
  }
  std::ranges::copy(direct_irradiance, direct_irradiance_.begin());
  compute_initial_exitance();
  apply_transfer();
  compute_radiosity();
}

void Engine::set_emission_scale(std::uint32_t material, const Float3& scale) {
  if (material >= data_->materials.size()) {
    throw Error("there is no material " + std::to_string(material) + "; the scene has " +
                std::to_string(data_->materials.size()));
  }
  if (!std::ranges::all_of(scale, [](float x) { return std::isfinite(x) && x >= 0; })) {
    throw Error("a scale of emission must be finite and at least 0");
  }
  for (std::size_t i = 0; i < emitted_exitance_.size(); ++i) {
    if ((*emitting_material_)[i] != material) continue;
    for (int c = 0; c < kChannelCount; ++c) {
      emitted_exitance_[i][c] = scale[c] * data_->patches.emitted_exitance[i][c];
    }
  }
}

void Engine::compute_initial_exitance() {
  add_reflected(emitted_exitance_, data_->patches.reflectance, direct_irradiance_,
                initial_exitance_);
}

void Engine::apply_transfer() {
  data_->transfer->apply(initial_exitance_, indirect_irradiance_, workspace_, scheduler_);
}

void Engine::compute_radiosity() {
  add_reflected(initial_exitance_, data_->patches.reflectance, indirect_irradiance_, radiosity_);
}

}  // namespace rebounce

#include "runtime/frame/engine_parts.h"

#include <algorithm>
#include <optional>
#include <string>

#include "rebounce/error.h"
#include "runtime/lights/emitting_material.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/lights/sky_light.h"
#include "transfer/base/argument_check.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

// In lx. What patches send on adds up in single precision, and up to here no sum overflows.
constexpr float kMostLight = 1e30F;

bool can_be_taken(const Float3& light) {
  return is_light(light, kMostLight);
}

/// The first patch that gets more than a frame can take, or what is no light.
std::optional<std::size_t> overexposed_patch(std::span<const Float3> irradiance) {
  if (are_light(irradiance, kMostLight)) return std::nullopt;
  return std::ranges::find_if_not(irradiance, can_be_taken) - irradiance.begin();
}

std::string too_much_light(std::size_t patch) {
  return "the direct irradiance of patch " + std::to_string(patch) + " is above 1e30 lx";
}

std::shared_ptr<const TransferData> checked(std::shared_ptr<const TransferData> data) {
  if (!data) throw Error("there are no transfer data; load a file first");
  if (!data->transfer) throw Error("the transfer data have no operator; make a file with one");
  return data;
}

}  // namespace

void check_lights(std::span<const Light> lights) {
  for (std::size_t k = 0; k < lights.size(); ++k) {
    try {
      check_light(lights[k]);
    } catch (const Error& error) {
      throw Error("light " + std::to_string(k) + ": " + error.what());
    }
  }
}

OneThread::OneThread(EngineUse& use) : use_(use) {
  if (!use_.busy.exchange(true, std::memory_order_acquire)) return;
  throw Error("two threads use one engine at the same time; give each one of its own");
}

OneThread::~OneThread() {
  use_.busy.store(false, std::memory_order_release);
}

Engine::Parts::Parts(std::shared_ptr<const TransferData> transfer_data,
                     const EngineSettings& settings)
    : data(checked(std::move(transfer_data))),
      scheduler(settings.scheduler),
      receiver_products(data->receiver_rows, data->patches.area),
      texel_products(data->texel_rows, data->patches.area) {
  tracer = std::make_shared<const RayTracer>(make_surface_tracer(data->mesh));
  direct_lighting = std::make_shared<DirectLighting>(*data, *tracer, settings.direct_lighting);
  const std::size_t n = data->patches.size();
  emitting_material =
      std::make_shared<const std::vector<std::uint32_t>>(find_emitting_material(*data));
  emitted_exitance = data->patches.emitted_exitance;
  direct_irradiance.resize(n);
  arriving.resize(n);
  initial_exitance.resize(n);
  indirect_irradiance.resize(n);
  radiosity.resize(n);
  workspace.resize(data->transfer->workspace_size());
  if (!data->lightmap.empty()) vertex_irradiance.resize(data->mesh.position.size());
  patch_light.resize(data->surface_harmonics.sky.size());
}

Engine::Parts::Parts(const Parts& other) = default;

void Engine::Parts::compute_initial_exitance() {
  add_reflected(emitted_exitance, data->patches.reflectance, direct_irradiance, initial_exitance);
}

void Engine::Parts::apply_transfer() {
  data->transfer->apply(initial_exitance, indirect_irradiance, workspace, scheduler);
}

void Engine::Parts::compute_radiosity() {
  add_reflected(initial_exitance, data->patches.reflectance, indirect_irradiance, radiosity);
}

Engine::Engine(std::shared_ptr<const TransferData> data, const EngineSettings& settings)
    : parts_(std::make_unique<Parts>(std::move(data), settings)) {}

Engine::Engine(const Engine& other) : parts_(std::make_unique<Parts>(*other.parts_)) {
  parts_->direct_lighting = std::make_shared<DirectLighting>(*other.parts_->direct_lighting);
}

Engine::~Engine() = default;
Engine::Engine(Engine&& other) noexcept = default;
Engine& Engine::operator=(Engine&& other) noexcept = default;

void Engine::Parts::compute_direct(std::span<const Light> lights, const Sky& frame_sky) {
  direct_lighting->compute(lights, frame_sky, arriving, scheduler);
  if (const auto patch = overexposed_patch(arriving)) {
    const bool by_sky = !can_be_taken(sky_irradiance(*data, frame_sky, *patch));
    const std::string source =
        by_sky ? "the sky" : "light " + std::to_string(direct_lighting->strongest_light(*patch));
    throw Error(source + " is too bright: " + too_much_light(*patch));
  }
  std::ranges::copy(arriving, direct_irradiance.begin());
  sky = frame_sky;
}

void Engine::relight(std::span<const Light> lights, const Sky& sky) {
  const OneThread guard(parts_->use);
  check_lights(lights);
  parts_->compute_direct(lights, sky);
  parts_->compute_initial_exitance();
  parts_->apply_transfer();
  parts_->compute_radiosity();
}

void Engine::relight(std::span<const Float3> direct_irradiance) {
  const OneThread guard(parts_->use);
  check_size("the direct irradiance", direct_irradiance.size(), parts_->direct_irradiance.size());
  if (const auto patch = overexposed_patch(direct_irradiance)) {
    check_light_of_patches("the direct irradiance", direct_irradiance);
    throw Error(too_much_light(*patch));
  }
  std::ranges::copy(direct_irradiance, parts_->direct_irradiance.begin());
  parts_->sky = {};
  parts_->compute_initial_exitance();
  parts_->apply_transfer();
  parts_->compute_radiosity();
}

void Engine::set_emission_scale(std::uint32_t material, const Float3& scale) {
  const OneThread guard(parts_->use);
  const SceneData& scene = *parts_->data;
  if (material >= scene.materials.size()) {
    throw Error("there is no material " + std::to_string(material) + "; the scene has " +
                std::to_string(scene.materials.size()));
  }
  if (!is_light(scale)) throw Error("a scale of emission must be finite and at least 0");
  const auto scaled = [&](std::size_t i) {
    Float3 exitance = scene.patches.emitted_exitance[i];
    for (int c = 0; c < kChannelCount; ++c) exitance[c] *= scale[c];
    return exitance;
  };
  const auto for_each = [&](const auto& visit) {
    for (std::size_t i = 0; i < parts_->emitted_exitance.size(); ++i) {
      if ((*parts_->emitting_material)[i] == material) visit(i);
    }
  };
  for_each([&](std::size_t i) {
    if (!can_be_taken(scaled(i))) {
      throw Error("a scale of emission makes light that is not finite or above 1e30 lx");
    }
  });
  for_each([&](std::size_t i) { parts_->emitted_exitance[i] = scaled(i); });
}

std::span<const Float3> Engine::direct_irradiance() const {
  return parts_->direct_irradiance;
}
std::span<const Float3> Engine::initial_exitance() const {
  return parts_->initial_exitance;
}
std::span<const Float3> Engine::indirect_irradiance() const {
  return parts_->indirect_irradiance;
}
std::span<const Float3> Engine::radiosity() const {
  return parts_->radiosity;
}
std::span<const Float3> Engine::emitted_exitance() const {
  return parts_->emitted_exitance;
}
const Sky& Engine::sky() const {
  return parts_->sky;
}
const Scheduler& Engine::scheduler() const {
  return parts_->scheduler;
}
const TransferData& Engine::data() const {
  return *parts_->data;
}
const std::shared_ptr<const TransferData>& Engine::shared_data() const {
  return parts_->data;
}

}  // namespace rebounce

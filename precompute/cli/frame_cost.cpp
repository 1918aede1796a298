#include "precompute/cli/frame_cost.h"

#include <fmt/format.h>

#include "runtime/demo/picture/key_light.h"
#include "runtime/frame/engine_parts.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::cli {
namespace {

/// The flux of an irradiance or exitance [n] in lx through the patches, in lumens.
double lumens(std::span<const Float3> value, std::span<const float> area) {
  double sum = 0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const auto& [r, g, b] = value[i];
    sum += static_cast<double>(area[i]) * (0.2126 * r + 0.7152 * g + 0.0722 * b);
  }
  return sum;
}

}  // namespace

FrameFlux flux_of(const Engine& engine, std::span<const Float3> indirect_irradiance) {
  const std::span<const float> area = engine.data().patches.area;
  return {.direct = lumens(engine.direct_irradiance(), area),
          .emitted = lumens(engine.emitted_exitance(), area),
          .indirect = lumens(indirect_irradiance, area)};
}

std::string described(const FrameFlux& flux) {
  // Four digits, without exponents.
  const auto lm = [](double x) {
    return fmt::format("{:.{}f} lm", x, x < 10 ? 3 : x < 1e3 ? 1 : 0);
  };
  return fmt::format(
      "light on all patches: {} directly from lamps and sky, {}{} indirectly", lm(flux.direct),
      flux.emitted > 0 ? lm(flux.emitted) + " emitted by surfaces, " : "", lm(flux.indirect));
}

nlohmann::json as_json(const FrameFlux& flux) {
  return {{"direct", flux.direct}, {"emitted", flux.emitted}, {"indirect", flux.indirect}};
}

FrameTimes relight_timed(Engine& engine, std::span<const Light> lights, const Sky& sky) {
  Engine::Parts& parts = engine.parts();
  FrameTimes times;
  times.direct = microseconds_of([&] { parts.compute_direct(lights, sky); });
  parts.compute_initial_exitance();
  times.product = microseconds_of([&] { parts.apply_transfer(); });
  parts.compute_radiosity();
  return times;
}

FrameTimes typical_times(Engine& engine) {
  Engine::Parts& parts = engine.parts();
  Light light = make_key_light(engine.data(), *parts.tracer);
  const float step = 100 * parts.tracer->offset_distance();
  FrameTimes times;
  times.direct = median_microseconds([&] {
    light.position[1] += step;  // another place in each frame, so that all is traced anew
    return microseconds_of([&] { parts.compute_direct({&light, 1}, {}); });
  });
  parts.compute_initial_exitance();
  times.product =
      median_microseconds([&] { return microseconds_of([&] { parts.apply_transfer(); }); });
  return times;
}

}  // namespace rebounce::cli

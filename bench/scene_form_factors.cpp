#include "bench/scene_form_factors.h"

#include <cmath>
#include <numbers>

#include "bench/exchange_error.h"
#include "bench/exchange_reference.h"
#include "bench/input.h"
#include "bench/named_quality.h"
#include "bench/stage_speed.h"
#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::bench {

SceneFormFactors::SceneFormFactors(const std::string& path, std::size_t patch_count,
                                   AskedTable& report)
    : name_(scene_name(path)),
      report_(report),
      model_(model_of_scene(path, patch_count)),
      tracer_(make_surface_tracer(model_.mesh)) {}

void SceneFormFactors::add(const char* quality, const std::string& measure, double value,
                           double asked) {
  report_.at_most(name_, area().size(), quality, measure, value, asked);
}

void SceneFormFactors::measure_convergence(int reference_factor) {
  const std::vector<double> light = smooth_light();
  const ExchangeReference truth = make_exchange_reference(model_, tracer_, light, reference_factor);
  add("", "noise of the gather's reference", truth.gather_noise);
  add("", "gather, one reference against the other",
      light_error(gather(truth.exchange_area, area(), light), truth.gathered, area()));
  std::vector<std::vector<double>> matrices;
  for (const NamedQuality& q : kQualities) {
    const FormFactors f = compute_form_factors(model_, tracer_, with_quality(q.quality));
    matrices.push_back(dense_exchange(f.exchange));
    const bool asked = q.quality == FormFactorQuality::kDefault;
    add(q.name, "rays per patch",
        static_cast<double>(f.ray_count) / static_cast<double>(area().size()));
    add(q.name, "gather F B, L2",
        light_error(gather(matrices.back(), area(), light), truth.gathered, area()),
        asked ? 3e-3 : 0);
    add(q.name, "F, Frobenius", form_factor_error(matrices.back(), truth.exchange_area, area()),
        asked ? 0.03 : 0);
    add(q.name, "row sums before closure", f.closure.row_sum_error_before);
    add(q.name, "F changed by closure", f.closure.relative_change);
  }
  matrices.push_back(truth.exchange_area);
  measure_ranks(matrices);
}

void SceneFormFactors::measure_speed(double ray_limit, int repeats) {
  const FormFactorSettings settings;
  FormFactors f = compute_form_factors(model_, tracer_, settings);
  StageSpeed speed(model_, tracer_, settings, ray_limit, f.ray_count);
  std::vector<double> samples;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    samples.push_back(seconds_of([&] { compute_form_factors(model_, tracer_, settings); }));
    speed.measure_once();
  }
  const double phase = summarise(samples).minimum;
  const double escape = static_cast<double>(area().size()) * settings.hemisphere_rays;
  const double shadow = static_cast<double>(f.ray_count) - escape;
  const double traced = speed.tracer_seconds(shadow, escape, &Timing::minimum);
  const double kernel = speed.kernel_seconds(static_cast<double>(f.pair_count), &Timing::minimum);
  report_.at_least(name_, area().size(), "default", "bare Embree / traced, same rays",
                   speed.bare_seconds(shadow, escape, &Timing::minimum) / traced, 0.7);
  add("default", "kernel / phase", kernel / phase);
  add("default", "neither rays nor kernel / phase", 1 - (traced + kernel) / phase, 0.15);
}

/// Two and a half waves across the scene's diagonal, on top of a constant.
std::vector<double> SceneFormFactors::smooth_light() const {
  const Box box = box_around(model_.patches.centroid);
  const glm::dvec3 low(box.low), high(box.high);
  std::vector<double> light;
  for (const Float3& c : model_.patches.centroid) {
    const glm::dvec3 x = (to_dvec3(c) - low) / glm::max(high - low, glm::dvec3(1e-9));
    light.push_back(1.5 + std::sin(5 * std::numbers::pi * (x.x + x.y + x.z) / 3));
  }
  return light;
}

/// `matrices` of the qualities, and of the reference.
void SceneFormFactors::measure_ranks(const std::vector<std::vector<double>>& matrices) {
  const FarRanksByVisibility ranks = far_ranks(model_, matrices);
  for (const auto& [kind, found] : {std::pair{"clear", &ranks.clear}, {"mixed", &ranks.mixed}}) {
    const std::string what = std::string("mean rank of ") + kind + " far blocks (" +
                             std::to_string(found->block_count) + ")";
    const double truth = found->mean_rank.back();
    add("reference", what, truth);
    for (std::size_t q = 0; q < kQualities.size(); ++q) {
      const bool asked = kQualities[q].quality == FormFactorQuality::kDefault;
      add(kQualities[q].name, what, found->mean_rank[q], asked ? 1.1 * truth : 0);
    }
  }
}

}  // namespace rebounce::bench

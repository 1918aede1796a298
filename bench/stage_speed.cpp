#include "bench/stage_speed.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "precompute/exchange/pairs/shadow_rays.h"
#include "transfer/base/error.h"

namespace rebounce::bench {
namespace {

std::uint32_t row_step_for(double ray_limit, std::uint64_t ray_count) {
  const double parts = static_cast<double>(ray_count) / ray_limit;
  return static_cast<std::uint32_t>(std::max(1.0, std::ceil(parts)));
}

std::string sample_name(const std::string& kind, TraceMode mode) {
  return kind + " " + name(mode);
}

}  // namespace

struct StageSpeed::Impl {
  const RayTracer& tracer;
  std::uint32_t row_step;
  PatchGeometry geometry;
  ShadowRays shadow_rays;
  StageRays rays;
  BareEmbree embree;

  Impl(const PatchModel& model, const RayTracer& ray_tracer, const FormFactorSettings& settings,
       std::uint32_t step)
      : tracer(ray_tracer),
        row_step(step),
        geometry(model, tracer),
        shadow_rays(geometry, settings.seed, settings.kernel_tolerance),
        rays(make_stage_rays(model, tracer, settings, row_step)),
        embree(model.mesh, rays) {}
};

StageSpeed::StageSpeed(const PatchModel& model, const RayTracer& tracer,
                       const FormFactorSettings& settings, double ray_limit,
                       std::uint64_t ray_count)
    : impl_(std::make_unique<Impl>(model, tracer, settings, row_step_for(ray_limit, ray_count))) {}

StageSpeed::~StageSpeed() = default;

void StageSpeed::measure_once() {
  measure_embree();
  measure_tracer();
  add("pairs", [&] { find_pairs(); });
}

void StageSpeed::add(const std::string& what, const std::function<void()>& work) {
  samples_[what].push_back(seconds_of(work));
}

void StageSpeed::measure_embree() {
  for (const TraceMode mode : kTraceModes) {
    impl_->embree.reset();
    add(sample_name("shadow", mode), [&] { impl_->embree.trace_shadow(mode); });
    add(sample_name("escape", mode), [&] { impl_->embree.trace_escape(mode); });
    check_agreement();
  }
}

/// Embree's packets and single rays round differently, so that a ray in a million that grazes an
/// edge may go either way; a mode that traced something else would be off by far more.
void StageSpeed::check_agreement() const {
  constexpr double kTolerance = 1e-4;
  const auto found = static_cast<double>(impl_->embree.hidden_count()),
             expected = static_cast<double>(impl_->rays.hidden_count);
  if (std::abs(found - expected) <= kTolerance * static_cast<double>(shadow_count())) return;
  throw Error("bare Embree and the ray tracer disagree: " + std::to_string(found) +
              " hidden rays, not " + std::to_string(expected));
}

/// The calls that the phase makes, on the rays that bare Embree gets.
void StageSpeed::measure_tracer() {
  std::vector<std::vector<Ray>> shadow = impl_->rays.shadow;
  const std::vector<std::vector<Ray>>& escape = impl_->rays.escape;
  add("tracer shadow", [&] {
#pragma omp parallel
    {
      std::vector<float> transmitted;
#pragma omp for schedule(dynamic, 4)
      for (std::vector<Ray>& stream : shadow) {
        transmitted.resize(stream.size());
        impl_->tracer.transmittance(stream, PassageDetail::kTriangle, transmitted);
      }
    }
  });
  add("tracer escape", [&] {
#pragma omp parallel
    {
      std::vector<Hit> hits;
#pragma omp for schedule(dynamic, 4)
      for (const std::vector<Ray>& stream : escape) {
        hits.resize(stream.size());
        impl_->tracer.intersect(stream, hits);
      }
    }
  });
}

void StageSpeed::find_pairs() {
  std::uint64_t pairs = 0;
  const std::uint32_t row_step = impl_->row_step;
#pragma omp parallel reduction(+ : pairs)
  {
    std::vector<FacingPatch> facing;
#pragma omp for schedule(dynamic, 4)
    for (std::size_t i = 0; i < impl_->geometry.patch_count(); i += row_step) {
      const auto is_fine = [&](std::uint32_t j) { return !is_coarse_pair(impl_->geometry, i, j); };
      impl_->shadow_rays.find_facing(static_cast<std::uint32_t>(i), facing, is_fine);
      pairs += facing.size();
    }
  }
  pair_count_ = pairs;
}

Timing StageSpeed::bare(const std::string& kind, TraceMode mode) const {
  return summarise(samples_.at(sample_name(kind, mode)));
}

double StageSpeed::fastest(const std::string& kind, double Timing::*figure) const {
  double seconds = std::numeric_limits<double>::infinity();
  for (const TraceMode mode : kTraceModes) seconds = std::min(seconds, bare(kind, mode).*figure);
  return seconds;
}

double StageSpeed::bare_seconds(double shadow, double escape, double Timing::*figure) const {
  return shadow * fastest("shadow", figure) / static_cast<double>(shadow_count()) +
         escape * fastest("escape", figure) / static_cast<double>(escape_count());
}

double StageSpeed::tracer_seconds(double shadow, double escape, double Timing::*figure) const {
  const Timing own_shadow = summarise(samples_.at("tracer shadow")),
               own_escape = summarise(samples_.at("tracer escape"));
  return shadow * own_shadow.*figure / static_cast<double>(shadow_count()) +
         escape * own_escape.*figure / static_cast<double>(escape_count());
}

double StageSpeed::kernel_seconds(double pairs, double Timing::*figure) const {
  return pairs * this->pairs().*figure / static_cast<double>(pair_count_);
}

std::uint64_t StageSpeed::shadow_count() const {
  return impl_->rays.shadow_count;
}

std::uint64_t StageSpeed::escape_count() const {
  return impl_->rays.escape_count;
}

}  // namespace rebounce::bench

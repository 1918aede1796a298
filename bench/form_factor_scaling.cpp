#include "bench/form_factor_scaling.h"

#include <cmath>

#include "bench/input.h"
#include "bench/process_cost.h"
#include "bench/timing.h"
#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/form_factors.h"

namespace rebounce::bench {
namespace {

/// What finding F with links took, from patches to form factors: no import, no operator.
struct ScalingSample {
  std::size_t patch_count = 0;
  double wall_seconds = 0;
  double processor_seconds = 0;  ///< of all threads, which others on the machine disturb less
  std::uint64_t ray_count = 0;
  std::uint64_t entry_count = 0;  ///< links
  double peak_bytes = 0;          ///< of the process so far: go from few patches to many
};

/// Finds F of the scene at `path` with about `patch_count` patches and links of `epsilon`.
ScalingSample measure_scaling(const std::string& path, std::size_t patch_count, double epsilon) {
  const PatchModel model = model_of_scene(path, patch_count);
  const RayTracer tracer = make_surface_tracer(model.mesh);
  FormFactorSettings settings;
  settings.link_epsilon = epsilon;
  ScalingSample sample{.patch_count = model.patches.size()};
  const double before = processor_seconds();
  sample.wall_seconds = seconds_of([&] {
    const LinkBuild build = build_links(model, tracer, settings);
    sample.ray_count = build.ray_count;
    sample.entry_count = build.links.pair.size();
  });
  sample.processor_seconds = processor_seconds() - before;
  sample.peak_bytes = static_cast<double>(peak_memory_bytes());
  return sample;
}

/// The exponent x with which processor seconds grow from `few` to `many` as patches^x.
double scaling_exponent(const ScalingSample& few, const ScalingSample& many) {
  return std::log(many.processor_seconds / few.processor_seconds) /
         std::log(static_cast<double>(many.patch_count) / static_cast<double>(few.patch_count));
}

}  // namespace

void measure_growth(const std::string& path, std::span<const std::size_t> patch_counts,
                    double epsilon, AskedTable& report) {
  const std::string name = scene_name(path);
  constexpr const char* what = "links";
  std::vector<ScalingSample> samples;
  for (const std::size_t count : patch_counts) {
    const ScalingSample s = measure_scaling(path, count, epsilon);
    const auto add = [&](const std::string& measure, double value, double asked = 0) {
      report.at_most(name, s.patch_count, what, measure, value, asked);
    };
    add("processor seconds of F", s.processor_seconds);
    add("seconds of F", s.wall_seconds);
    add("rays per patch", static_cast<double>(s.ray_count) / static_cast<double>(s.patch_count));
    add("entries per patch",
        static_cast<double>(s.entry_count) / static_cast<double>(s.patch_count));
    add("peak memory, GiB", s.peak_bytes / 0x1p30, 12);
    samples.push_back(s);
  }
  if (samples.size() < 2) return;
  report.at_most(name, samples.back().patch_count, what,
                 "exponent from " + std::to_string(samples.front().patch_count) + " patches",
                 scaling_exponent(samples.front(), samples.back()), 1.35);
}

}  // namespace rebounce::bench

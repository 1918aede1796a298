#include "form_factor_scaling.h"

#include <sys/resource.h>

#include <cmath>

#include "input.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/precompute/links.h"
#include "timing.h"

namespace rebounce::bench {
namespace {

rusage usage() {
  rusage result{};
  getrusage(RUSAGE_SELF, &result);
  return result;
}

double processor_seconds(const rusage& u) {
  return static_cast<double>(u.ru_utime.tv_sec + u.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

}  // namespace

ScalingSample measure_scaling(const std::string& path, std::size_t patch_count, double epsilon,
                              LinkedForm form) {
  const PatchModel model = model_of_scene(path, patch_count);
  const RayTracer tracer = make_surface_tracer(model.mesh);
  FormFactorSettings settings;
  settings.link_epsilon = epsilon;
  ScalingSample sample{.patch_count = model.patches.size()};
  const double before = processor_seconds(usage());
  sample.wall_seconds = seconds_of([&] {
    if (form == LinkedForm::kLinks) {
      const LinkBuild build = build_links(model, tracer, settings);
      sample.ray_count = build.ray_count;
      sample.entry_count = build.links.pair.size();
    } else {
      const FormFactors f = compute_form_factors(model, tracer, settings);
      sample.ray_count = f.ray_count;
      sample.entry_count = f.exchange.column.size();
    }
  });
  sample.processor_seconds = processor_seconds(usage()) - before;
  sample.peak_bytes = 1024.0 * static_cast<double>(usage().ru_maxrss);
  return sample;
}

double scaling_exponent(const ScalingSample& few, const ScalingSample& many) {
  return std::log(many.processor_seconds / few.processor_seconds) /
         std::log(static_cast<double>(many.patch_count) / static_cast<double>(few.patch_count));
}

}  // namespace rebounce::bench

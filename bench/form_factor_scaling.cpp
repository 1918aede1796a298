#include "form_factor_scaling.h"

#include <cmath>

#include "input.h"
#include "process_cost.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/precompute/links.h"
#include "timing.h"

namespace rebounce::bench {

ScalingSample measure_scaling(const std::string& path, std::size_t patch_count, double epsilon,
                              LinkedForm form) {
  const PatchModel model = model_of_scene(path, patch_count);
  const RayTracer tracer = make_surface_tracer(model.mesh);
  FormFactorSettings settings;
  settings.link_epsilon = epsilon;
  ScalingSample sample{.patch_count = model.patches.size()};
  const double before = processor_seconds();
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
  sample.processor_seconds = processor_seconds() - before;
  sample.peak_bytes = static_cast<double>(peak_memory_bytes());
  return sample;
}

double scaling_exponent(const ScalingSample& few, const ScalingSample& many) {
  return std::log(many.processor_seconds / few.processor_seconds) /
         std::log(static_cast<double>(many.patch_count) / static_cast<double>(few.patch_count));
}

}  // namespace rebounce::bench

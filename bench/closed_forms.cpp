#include "bench/closed_forms.h"

#include <algorithm>
#include <cmath>

#include "bench/exchange_error.h"
#include "bench/known_form_factors.h"
#include "bench/named_quality.h"
#include "precompute/exchange/pairs/patch_geometry.h"
#include "tests/support/form_factor_sums.h"

namespace rebounce::bench {
namespace {

FormFactors form_factors_of(const PatchModel& model, FormFactorQuality quality) {
  return compute_form_factors(model, make_surface_tracer(model.mesh), with_quality(quality));
}

void measure_known(const std::vector<KnownFormFactor>& cases, std::size_t patch_count,
                   AskedTable& report) {
  for (const KnownFormFactor& known : cases) {
    const PatchModel model = make_patch_model(known.scene, {.patch_count = patch_count});
    for (const NamedQuality& q : kQualities) {
      if (q.asked_part == 0) continue;
      const FormFactors f = form_factors_of(model, q.quality);
      const double error = std::abs(test::factor_between(model, f, 0, 1) - known.factor);
      report.at_most(
          known.name, model.patches.size(), q.name, "error of F", error,
          std::max(q.asked_part * known.factor, q.asked_least) + known.model_error * known.factor);
    }
  }
}

void measure_closed(const std::string& name, const PatchModel& model, AskedTable& report) {
  for (const NamedQuality& q : kQualities) {
    if (q.asked_part == 0) continue;
    const FormFactors f = form_factors_of(model, q.quality);
    const std::size_t n = model.patches.size();
    report.at_most(name, n, q.name, "row sums before closure", f.closure.row_sum_error_before,
                   1e-3);
    report.at_most(name, n, q.name, "row sums after closure", f.closure.row_sum_error_after, 1e-6);
  }
}

void measure_rooms(AskedTable& report) {
  Scene cube = test::empty_scene(), flat_room = test::empty_scene(), room = test::empty_scene();
  test::add_box(cube, {0, 0, 0}, {1, 1, 1}, true);
  test::add_box(flat_room, {-5, 0, 2}, {15, 2.5, 8}, true);
  test::add_box(room, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(room, {1, 0.3, 1}, {2, 1.2, 2.5}, false);
  test::add_box(room, {2.5, 1.5, 3}, {3, 2, 4}, false);
  measure_closed("cube", make_patch_model(cube, {.patch_count = 1000}), report);
  measure_closed("room 20 x 2.5 x 6", make_patch_model(flat_room, {.patch_count = 1000}), report);
  measure_closed("room with two blocks", make_patch_model(room, {.patch_count = 1000}), report);
}

/// From inside, F(i,j) = A(j) / A of a sphere. Triangles differ from it by their tessellation,
/// which their exact kernels tell: nothing hides anything in there.
void measure_sphere(int longitudes, AskedTable& report) {
  Scene scene = test::empty_scene();
  test::add_ball(scene, longitudes, longitudes / 2, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = scene.triangle.size()});
  const RayTracer tracer = make_surface_tracer(model.mesh);
  const PatchGeometry geometry(model, tracer);
  const std::size_t n = model.patches.size();
  double total = 0;
  for (const float area : model.patches.area) total += area;
  std::vector<double> sphere(n * n), exact(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      sphere[i * n + j] = model.patches.area[i] * model.patches.area[j] / total;
      if (i != j) exact[i * n + j] = unoccluded_exchange_area(geometry, i, j, 1e-6);
    }
  }
  const std::string name = "sphere of " + std::to_string(model.mesh.triangle.size()) + " triangles";
  const double tessellation = form_factor_error(exact, sphere, model.patches.area);
  report.at_most(name, n, "", "kernel against A(j) / A", tessellation, 0);
  const std::vector<double> found =
      dense_exchange(form_factors_of(model, FormFactorQuality::kDefault).exchange);
  report.at_most(name, n, "default", "F against A(j) / A",
                 form_factor_error(found, sphere, model.patches.area), 1.01 * tessellation);
}

}  // namespace

void measure_closed_forms(const std::string& view_factors, AskedTable& report) {
  measure_known(tabled_form_factors(view_factors), 200, report);
  measure_known(hidden_form_factors(), 600, report);
  measure_rooms(report);
  for (const int longitudes : {16, 32}) measure_sphere(longitudes, report);
}

}  // namespace rebounce::bench

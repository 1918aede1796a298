#include "rebounce/precompute/form_factors.h"

#include <gtest/gtest.h>

#include "test_scenes.h"
namespace rebounce {
namespace {
TEST(X, cube) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  PatchModel model = make_patch_model(scene, {.patch_count = 12});
  RayTracer tracer = test::make_tracer(model);
  FormFactors f = compute_form_factors(model, tracer);
  printf("before %g after %g\n", f.closure.row_sum_error_before, f.closure.row_sum_error_after);
  double sum = 0;
  for (float s : f.exchange.exchange_area) sum += 2 * s;
  printf("sum %g\n", sum);
  for (size_t i = 0; i < 12; i++) {
    for (auto k = f.exchange.row_begin[i]; k < f.exchange.row_begin[i + 1]; ++k)
      printf("(%zu,%u) %.5f  ", i, f.exchange.column[k], f.exchange.exchange_area[k]);
    printf("\n");
  }
}
}  // namespace
}  // namespace rebounce

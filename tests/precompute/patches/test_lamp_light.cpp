#include "precompute/patches/lamp_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "precompute/patches/patch_model.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/rays/sampling.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_lamp_light {
namespace {

constexpr std::size_t kPatches = 800;

Light lamp_at(const Float3& position) {
  Light lamp;
  lamp.position = position;
  lamp.intensity = 100;
  return lamp;
}

/// A room with a block that casts a shadow, and a lamp.
Scene lit_room() {
  Scene scene = test::room_with_block({0.5F, 0.5F, 0.5F});
  scene.lights = {lamp_at({1.5F, 2.2F, 1.75F})};
  return scene;
}

PatchModel patches_of(const Scene& scene, double weight) {
  return make_patch_model(scene, {.patch_count = kPatches, .lamp_weight = weight});
}

/// The direct light of a lamp at a point, lx.
double light_at(const Light& lamp, const glm::dvec3& place, const glm::dvec3& normal,
                const RayTracer& tracer) {
  const Float3 point = tracer.offset_point(to_float3(place), to_float3(normal));
  const IncidentLight light = evaluate_light(lamp, point);
  const double cosine = glm::dot(to_dvec3(light.direction), normal);
  if (cosine <= 0) return 0;
  std::vector<Ray> ray(1);
  ray[0].origin = point;
  ray[0].direction = light.direction;
  ray[0].t_near = 0;
  ray[0].t_far = shadow_ray_length(light.distance);
  tracer.occluded(ray);
  return is_occluded(ray[0]) ? 0 : cosine * light.illuminance[0];
}

/// The direct light of `lamp` less the mean over its patch, root mean square over the surface as a
/// part of that of the light.
double variation_within_patches(const PatchModel& model, const Light& lamp) {
  constexpr int kPoints = 16;
  const RayTracer tracer = test::make_tracer(model);
  const std::size_t n = model.patches.size();
  std::vector<double> area(n, 0.0), sum(n, 0.0), square(n, 0.0);
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    const std::uint32_t i = model.mesh.triangle_patch[t];
    if (i == kNone) continue;
    const TriangleCorners corners = corners_of(model.mesh, t);
    for (std::uint32_t k = 0; k < kPoints; ++k) {
      const glm::dvec2 place = square_to_triangle(r2_point(k, glm::dvec2(0.3)));
      const double light = light_at(lamp, point_at(corners, place), front_normal(corners), tracer);
      const double part = area_of(corners) / kPoints;
      area[i] += part;
      sum[i] += part * light;
      square[i] += part * light * light;
    }
  }
  double within = 0, whole = 0;
  for (std::size_t i = 0; i < n; ++i) {
    within += square[i] - sum[i] * sum[i] / area[i];
    whole += square[i];
  }
  return std::sqrt(within / whole);
}

TEST(LampLight, VariesLessWithinAsManyPatches) {
  const Scene scene = lit_room();
  const PatchModel equal = patches_of(scene, 0), finer = patches_of(scene, 4);
  EXPECT_NEAR(static_cast<double>(finer.patches.size()), static_cast<double>(equal.patches.size()),
              0.02 * kPatches);
  const double before = variation_within_patches(equal, scene.lights[0]);
  EXPECT_GT(before, 0.1);
  EXPECT_LT(variation_within_patches(finer, scene.lights[0]), 0.5 * before);
}

TEST(LampLight, AreaIsKept) {
  double area = 0;
  for (const float a : patches_of(lit_room(), 4).patches.area) area += a;
  EXPECT_NEAR(area, 94 + 2 * (0.7 + 1.5 + 1.05), 1e-3);
}

TEST(LampLight, PatchesAreSmallNearALampThatShinesFromASurface) {
  // Half a metre below a disc of 20 cm, and in a far corner of the floor.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  Light lamp;
  lamp.type = LightType::kDisc;
  lamp.position = {1, 0.5F, 1};
  lamp.radius = 0.1F;
  lamp.intensity = 1000;
  scene.lights = {lamp};
  const PatchModel model = patches_of(scene, 4);
  double near = 1e9, far = 0;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    const glm::dvec3 place = to_dvec3(model.patches.centroid[i]);
    const auto area = static_cast<double>(model.patches.area[i]);
    if (glm::distance(place, glm::dvec3(1, 0, 1)) < 0.4) near = std::min(near, area);
    if (glm::distance(place, glm::dvec3(3.5, 0, 4.5)) < 0.4) far = std::max(far, area);
  }
  EXPECT_LT(4 * near, far);
}

TEST(LampLight, EmittingSurfacesCountAsLamps) {
  Scene scene = test::room_with_block({0.5F, 0.5F, 0.5F});
  scene.materials.resize(2, scene.materials[0]);
  scene.materials[1].emitted_luminance = {500, 500, 500};
  const std::vector<glm::dvec3> panel = {
      {1.4, 2.9, 1.7}, {1.6, 2.9, 1.7}, {1.6, 2.9, 1.9}, {1.4, 2.9, 1.9}};
  test::add_polygon(scene, panel, 1);
  Light lamp = lamp_at({1.5F, 2.899F, 1.8F});  // shines as the panel does, from its middle
  lamp.type = LightType::kRectangle;
  lamp.size = {0.2F, 0.2F};
  const double equal = variation_within_patches(patches_of(scene, 0), lamp);
  EXPECT_LT(variation_within_patches(patches_of(scene, 4), lamp), 0.75 * equal);
}

/// The patch of each triangle, and where triangles are.
auto mesh_of(const PatchModel& model) {
  return std::pair(model.mesh.triangle_patch, model.mesh.position);
}

TEST(LampLight, WithoutLightPatchesAreAsWithoutLamps) {
  const Scene scene = lit_room();
  Scene dark = scene, none = scene;
  none.lights.clear();
  const auto expected = mesh_of(patches_of(none, 4));
  EXPECT_EQ(mesh_of(patches_of(scene, 0)), expected) << "no weight";
  dark.lights = {lamp_at({1.5F, 0.8F, 1.5F})};
  EXPECT_EQ(mesh_of(patches_of(dark, 4)), expected) << "inside of the block";
  dark.lights[0].intensity = 0;
  EXPECT_EQ(mesh_of(patches_of(dark, 4)), expected) << "turned off";
  EXPECT_NE(mesh_of(patches_of(scene, 4)), expected);
}

TEST(LampLight, LampsInSurfacesAndTooBrightOnesDoNoHarm) {
  Scene scene = lit_room();
  scene.lights = {lamp_at({2, 0, 2.5F}), lamp_at({0, 0, 0}), lamp_at({1.5F, 0.5F, 1.75F})};
  for (const float intensity : {1e-30F, 1.0F, 3e38F}) {
    for (Light& lamp : scene.lights) lamp.intensity = intensity;
    const PatchModel model = patches_of(scene, 4);
    EXPECT_NEAR(static_cast<double>(model.patches.size()), kPatches, 0.02 * kPatches);
    for (std::size_t i = 0; i < model.patches.size(); ++i) {
      ASSERT_GT(model.patches.area[i], 0) << intensity;
      ASSERT_TRUE(std::isfinite(model.patches.centroid[i][0])) << intensity;
    }
  }
}

TEST(LampLight, SurfacesWithEmissionBeyondNumbersCountAsNone) {
  Scene scene = test::room_with_block({0.5F, 0.5F, 0.5F});
  scene.materials[0].emitted_luminance = {2e38F, 2e38F, 2e38F};
  EXPECT_EQ(mesh_of(patches_of(scene, 4)), mesh_of(patches_of(scene, 0)));
}

TEST(LampLight, IntensityAndNumberOfThreadsChangeNothing) {
  Scene scene = lit_room();
  const auto make = [&] { return mesh_of(patches_of(scene, 4)); };
  const auto one = test::with_threads(1, make), three = test::with_threads(3, make);
  EXPECT_EQ(one, three);
  scene.lights[0].intensity *= 4;
  EXPECT_EQ(make(), one);
}

}  // namespace
}  // namespace rebounce::test_lamp_light

#include <gtest/gtest.h>

#include <vector>

#include "bench/reference/compare.h"
#include "bench/reference/compare_receivers.h"
#include "precompute/outputs/reconstruction_weights.h"
#include "precompute/patches/lit_sides.h"
#include "rebounce/error.h"
#include "tests/support/scene_data.h"
#include "tests/support/test_scenes.h"

namespace rebounce::reference::test_compare {
namespace {

/// A closed room in which every surface emits 1 lx and reflects half: H is 2 lx everywhere.
struct Furnace {
  Scene scene = test::empty_scene({0.5F, 0.5F, 0.5F});
  TransferData data;

  explicit Furnace(bool with_box = false) {
    scene.materials[0].emitted_luminance = {0.318309886F, 0.318309886F, 0.318309886F};
    test::add_box(scene, {0, 0, 0}, {3, 2, 2}, true);
    if (with_box) add_box_without_underside();
    const PatchModel model = make_patch_model(scene, {.patch_count = 200});
    data = test::data_of(model);
    compute_reconstruction_weights(model.shown_patch, data.patches.absorbed, mesh_tracer(),
                                   data.mesh);
  }

  void add_box_without_underside() {
    test::add_box(scene, {1, 0.5, 0}, {1.8, 1.2, 0.9}, false);
    test::remove_face(scene, test::Face::kLowZ, 1);
  }

  RayTracer mesh_tracer() const { return make_surface_tracer(data.mesh); }

  std::vector<Float3> uniform(float value) const {
    return std::vector<Float3>(data.patches.size(), Float3{value, value, value});
  }
};

PatchComparisonSettings quick_settings(std::size_t patch_count) {
  return {.patch_count = patch_count, .points_per_patch = 16, .samples_per_point = 32};
}

TEST(PatchMeans, ErrorIsWhatWasPutIn) {
  const Furnace furnace;
  const RayTracer tracer = make_scene_tracer(furnace.scene);
  const LitScene lit_scene{furnace.scene, tracer, {}, {}};
  for (const std::size_t count : {std::size_t{0}, std::size_t{50}}) {
    const PatchComparison exact =
        compare_patch_means(furnace.data, furnace.uniform(2), lit_scene, quick_settings(count));
    const PatchComparison off =
        compare_patch_means(furnace.data, furnace.uniform(2.2F), lit_scene, quick_settings(count));
    // What is left of 50 patches' noise is known to within some 0.45 of the noise.
    EXPECT_LT(exact.relative.error, 0.8 * exact.relative.noise);
    EXPECT_GT(exact.relative.noise, 0.005);
    EXPECT_LT(exact.relative.noise, 0.05);
    EXPECT_NEAR(off.relative.error, 0.1, 0.005);
    EXPECT_EQ(exact.relative.left_out_count, 0U);
    EXPECT_EQ(exact.relative.count, exact.patch.size());
    EXPECT_EQ(exact.truth.size(), exact.patch.size());
    if (count == 0) {
      EXPECT_EQ(exact.patch.size(), furnace.data.patches.size());
    } else {
      EXPECT_LE(exact.patch.size(), count);
      EXPECT_GT(exact.patch.size(), count / 2);
    }
  }
}

TEST(PatchMeans, SizesAreChecked) {
  const Furnace furnace;
  const RayTracer tracer = make_scene_tracer(furnace.scene);
  EXPECT_THROW(compare_patch_means(furnace.data, {}, {furnace.scene, tracer, {}, {}}, {}), Error);
}

/// Points of a furnace, and what the path tracer would find there without noise.
struct FurnacePoints {
  std::vector<SurfacePoint> points;
  IrradianceEstimate truth;

  explicit FurnacePoints(const Scene& scene)
      : points(sample_surface(scene, find_lit_sides(scene, make_scene_tracer(scene)), 500, 1)) {
    truth.mean.assign(points.size(), Float3{2, 2, 2});
    truth.standard_error.assign(points.size(), Float3{0, 0, 0});
    truth.absorbed.assign(points.size(), 0.0F);
  }
};

TEST(Reconstruction, EveryPointIsFoundOnTheMesh) {
  const Furnace furnace;
  const FurnacePoints f(furnace.scene);
  const RelativeError exact = compare_reconstruction(furnace.data, furnace.mesh_tracer(),
                                                     furnace.uniform(2), f.points, f.truth)
                                  .relative;
  EXPECT_LT(exact.error, 1e-6);
  EXPECT_EQ(exact.noise, 0);
  EXPECT_EQ(exact.count, 500U);
  const RelativeError off = compare_reconstruction(furnace.data, furnace.mesh_tracer(),
                                                   furnace.uniform(2.2F), f.points, f.truth)
                                .relative;
  EXPECT_NEAR(off.error, 0.1, 1e-6);
}

TEST(Reconstruction, PointsInASlotAreNotSeen) {
  Scene scene = test::empty_scene({0.5F, 0.5F, 0.5F});
  test::add_box(scene, {0, 0, 0}, {3, 2, 2}, true);
  test::add_box(scene, {0.5, 0.01, 0.5}, {2.5, 0.2, 1.5}, false);
  const PatchModel model = make_patch_model(scene, {.patch_count = 200});
  TransferData data = test::data_of(model);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  compute_reconstruction_weights(model.shown_patch, data.patches.absorbed, tracer, data.mesh);
  FurnacePoints f(scene);
  std::size_t in_slot = 0;
  for (std::size_t k = 0; k < f.points.size(); ++k) {
    const auto& [x, y, z] = f.points[k].position;
    if (y > 0.011F || x < 0.5F || x > 2.5F || z < 0.5F || z > 1.5F) continue;
    f.truth.mean[k] = {0, 0, 0};
    ++in_slot;
  }
  ASSERT_GT(in_slot, 20U);
  const ReconstructionComparison shown = compare_reconstruction(
      data, tracer, std::vector<Float3>(data.patches.size(), Float3{2, 2, 2}), f.points, f.truth);
  EXPECT_GT(shown.relative.error, 0.2);
  // Some at its border are.
  EXPECT_LT(shown.seen.error, 0.15);
  EXPECT_GE(shown.seen.left_out_count, in_slot - 12);
  EXPECT_LE(shown.seen.left_out_count, in_slot + 1);
}

TEST(Reconstruction, IsLinearBetweenVertices) {
  // Each vertex takes its own x from one patch that holds 1: the value at a point is its x.
  Furnace furnace;
  DisplayMesh& mesh = furnace.data.mesh;
  mesh.weight_begin = {0};
  mesh.weight_patch.clear();
  mesh.weight.clear();
  for (const Float3& p : mesh.position) {
    mesh.weight_patch.push_back(0);
    mesh.weight.push_back(p[0]);
    mesh.weight_begin.push_back(static_cast<std::uint32_t>(mesh.weight.size()));
  }
  FurnacePoints f(furnace.scene);
  for (std::size_t k = 0; k < f.points.size(); ++k) {
    const float x = f.points[k].position[0];
    f.truth.mean[k] = {x, x, x};
  }
  const RelativeError error = compare_reconstruction(furnace.data, furnace.mesh_tracer(),
                                                     furnace.uniform(1), f.points, f.truth)
                                  .relative;
  EXPECT_LT(error.error, 1e-5);
  EXPECT_EQ(error.count, 500U);
}

TEST(Reconstruction, NoiseIsTakenOut) {
  const Furnace furnace;
  FurnacePoints f(furnace.scene);
  for (std::size_t k = 0; k < f.points.size(); ++k) {
    const float sign = k % 2 == 0 ? 1.0F : -1.0F;
    f.truth.mean[k] = {2 + 0.1F * sign, 2 + 0.1F * sign, 2 + 0.1F * sign};
    f.truth.standard_error[k] = {0.1F, 0.1F, 0.1F};
  }
  const RelativeError error = compare_reconstruction(furnace.data, furnace.mesh_tracer(),
                                                     furnace.uniform(2.2F), f.points, f.truth)
                                  .relative;
  EXPECT_NEAR(error.noise, 0.05, 1e-4);
  EXPECT_NEAR(error.error, 0.1, 1e-4);
}

TEST(Reconstruction, PointsThatSeeOnlyBackFacesAreLeftOut) {
  const Furnace furnace(true);
  const RayTracer tracer = make_scene_tracer(furnace.scene);
  const auto points = sample_surface(furnace.scene, find_lit_sides(furnace.scene, tracer), 500, 1);
  const IrradianceEstimate truth =
      indirect_irradiance({furnace.scene, tracer, {}, {}}, points, 64, 1);
  const RelativeError error =
      compare_reconstruction(furnace.data, furnace.mesh_tracer(), furnace.uniform(2), points, truth)
          .relative;
  // 0.56 m² of the floor, of about 35 m² in all.
  EXPECT_GT(error.left_out_count, 4U);
  EXPECT_LT(error.left_out_count, 13U);
  EXPECT_EQ(error.count + error.left_out_count, 500U);
  EXPECT_LT(error.error, 0.02);
}

TEST(Receivers, SeeTheSameInAFurnace) {
  const Furnace furnace;
  const FurnacePoints f(furnace.scene);
  const RayTracer tracer = furnace.mesh_tracer();
  const std::vector<Float3> h = furnace.uniform(2);
  const ReconstructionComparison shown =
      compare_reconstruction(furnace.data, tracer, h, f.points, f.truth);
  const ReceiverErrors error =
      compare_receivers({furnace.data, tracer, h, {}, {}}, shown, f.points, f.truth, 1);
  for (const RelativeError& e :
       {error.patch_value, error.rows, error.smooth_light, error.exact_lamps, error.exact_both}) {
    EXPECT_EQ(e.count, 500U);
    EXPECT_LT(e.error, 1e-5);
  }
}

TEST(Receivers, LampsLookedAtAnewAreCloserToTheTruthThanEvenPatches) {
  // A lamp half a metre below the ceiling, in patches of about a square metre.
  Scene scene = test::empty_scene({0.5F, 0.5F, 0.5F});
  test::add_box(scene, {0, 0, 0}, {3, 2, 2}, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = 30});
  TransferData data = test::data_of(model);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  compute_reconstruction_weights(model.shown_patch, data.patches.absorbed, tracer, data.mesh);
  Light lamp;
  lamp.type = LightType::kPoint;
  lamp.position = {1.2F, 1.5F, 0.9F};
  lamp.intensity = 100;
  const RayTracer scene_tracer = make_scene_tracer(scene);
  const LitScene lit_scene{scene, scene_tracer, {&lamp, 1}, {}};
  const auto points = sample_surface(scene, find_lit_sides(scene, scene_tracer), 300, 1);
  const IrradianceEstimate truth = indirect_irradiance(lit_scene, points, 512, 1);
  const std::vector<Float3> h =
      compare_patch_means(data, std::vector<Float3>(data.patches.size()), lit_scene,
                          {.patch_count = 0, .points_per_patch = 64, .samples_per_point = 64})
          .truth;
  ASSERT_EQ(h.size(), data.patches.size());
  const ReconstructionComparison shown = compare_reconstruction(data, tracer, h, points, truth);
  const ReceiverErrors error =
      compare_receivers({data, tracer, h, {&lamp, 1}, {}}, shown, points, truth, 1);
  EXPECT_GT(error.patch_value.error, 0.05);
  EXPECT_LT(error.exact_lamps.error, 0.5 * error.rows.error);
  // What is left is the noise of 1,024 rays and of the truth, and patches in second bounces.
  EXPECT_LT(error.exact_both.error, 0.04);
}

TEST(Receivers, SizesAreChecked) {
  const Furnace furnace;
  const FurnacePoints f(furnace.scene);
  const RayTracer tracer = furnace.mesh_tracer();
  EXPECT_THROW(compare_receivers({furnace.data, tracer, {}, {}, {}}, {}, f.points, f.truth, 1),
               Error);
}

}  // namespace
}  // namespace rebounce::reference::test_compare

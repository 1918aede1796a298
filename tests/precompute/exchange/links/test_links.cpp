// Links between sets of patches against all pairs: energy, reciprocity, closure, visibility.

#include "precompute/exchange/links/links.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include "precompute/exchange/links/refined_links.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "rebounce/error.h"
#include "runtime/solvers/gauss_seidel_solver.h"
#include "runtime/solvers/hierarchical_solver.h"
#include "tests/precompute/exchange/links/linked_patches.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/exchange/form_factor_blocks.h"

namespace rebounce::test_links {
namespace {

Scene empty_room() {
  Scene scene = test::empty_scene();
  test::add_box(scene, {-1, 0, 2}, {3, 2.5, 8}, true);
  return scene;
}

PatchModel model_of(const Scene& scene, std::size_t patch_count = 600) {
  return make_patch_model(scene, {.patch_count = patch_count});
}

LinkBuild links_of(const PatchModel& model, double epsilon = kLinkEpsilon) {
  return LinkBuilder(model, test::make_tracer(model), {}).build(epsilon);
}

FormFactors form_factors_of(const PatchModel& model) {
  return compute_form_factors(model, test::make_tracer(model));
}

/// What several tests look at, made once: the furnished room, its links and all its pairs.
struct Furnished {
  PatchModel model = model_of(test::furnished_room());
  LinkBuild build = links_of(model);
  FormFactors pairs = form_factors_of(model);
};

const Furnished& furnished() {
  static const Furnished room;
  return room;
}

/// Light that changes smoothly from place to place.
std::vector<Float3> smooth_light(const PatchTable& patches) {
  std::vector<Float3> light;
  for (const Float3& p : patches.centroid) {
    light.push_back({1 + 0.5F * std::sin(p[0]), 2 + p[1], 1 + 0.3F * std::cos(p[2])});
  }
  return light;
}

TEST(Links, CarryTheEnergyOfThePairs) {
  const auto& [model, build, pairs] = furnished();
  const std::vector<Float3> ones(model.patches.size(), {1, 1, 1});
  const std::vector<Float3> arrived = gather(*build.form_factors, ones);
  double by_links = 0, by_pairs = 0;
  for (std::size_t i = 0; i < ones.size(); ++i) by_links += model.patches.area[i] * arrived[i][0];
  for (const float s : pairs.exchange.exchange_area) by_pairs += 2 * s;
  EXPECT_NEAR(by_links / by_pairs, 1, 2e-3);
  EXPECT_LT(build.form_factors->link_count(), pairs.exchange.column.size() / 2);
}

TEST(Links, AreReciprocal) {
  const PatchModel& model = furnished().model;
  const LinkedFormFactors& links = *furnished().build.form_factors;
  std::mt19937 engine(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  const auto random = [&] {
    std::vector<Float3> light(model.patches.size());
    for (Float3& x : light) x = {uniform(engine), uniform(engine), uniform(engine)};
    return light;
  };
  const std::vector<Float3> x = random(), y = random();
  const std::vector<Float3> fx = gather(links, x), fy = gather(links, y);
  double there = 0, back = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    there += static_cast<double>(model.patches.area[i]) * y[i][0] * fx[i][0];
    back += static_cast<double>(model.patches.area[i]) * x[i][0] * fy[i][0];
  }
  EXPECT_NEAR(there / back, 1, 1e-6);
}

TEST(Links, FurnaceInAClosedBox) {
  const PatchModel model = model_of(empty_room());
  const LinkedFormFactors links = *links_of(model).form_factors;
  HierarchicalSolver solver(links, {model.patches.area, model.patches.reflectance});
  const std::vector<Float3> emitted(model.patches.size(), {1, 1, 1});
  const SolveResult result = solver.solve(emitted);
  EXPECT_TRUE(result.converged);
  for (const Float3& b : solver.radiosity()) EXPECT_NEAR(b[0], 2, 1e-3 * 2);  // reflectance 0.5
}

TEST(Links, GatherAndSolveLikeAllPairs) {
  const PatchModel& model = furnished().model;
  const LinkedFormFactors& links = *furnished().build.form_factors;
  const FormFactorBlocks pairs(furnished().pairs.exchange, model.patches.area);
  const std::vector<Float3> light = smooth_light(model.patches);
  EXPECT_LT(relative_difference(gather(links, light), gather(pairs, light), model.patches.area),
            2e-3);

  const RadiosityProblem problem{model.patches.area, model.patches.reflectance};
  HierarchicalSolver hierarchical(links, problem);
  GaussSeidelSolver flat(pairs, problem);
  // One wall shines and nothing else does.
  std::vector<Float3> emitted(model.patches.size(), {0, 0, 0});
  for (std::size_t i = 0; i < emitted.size(); ++i) {
    if (model.patches.centroid[i][0] < 1e-3F) emitted[i] = {1, 2, 3};
  }
  hierarchical.solve(emitted);
  flat.solve(emitted);
  EXPECT_LT(relative_difference(hierarchical.radiosity(), flat.radiosity(), model.patches.area),
            5e-3);
}

TEST(Links, BetweenSinglePatchesAreAsExactAsPairs) {
  const PatchModel model = model_of(test::furnished_room(), 200);
  const LinkBuild build = links_of(model, 1e-6);
  const FormFactorLinks links = flat_links(*build.form_factors);
  const auto single = [&](const std::array<std::uint32_t, 2>& pair) {
    return links.count[pair[0]] == 1 && links.count[pair[1]] == 1;
  };
  const auto singles = std::ranges::count_if(links.pair, single);
  ASSERT_GT(static_cast<double>(singles), 0.9 * static_cast<double>(links.pair.size()));
  // The same rays; closure alone differs.
  const FormFactorBlocks pairs(form_factors_of(model).exchange, model.patches.area);
  const std::vector<Float3> light = smooth_light(model.patches);
  EXPECT_LT(relative_difference(gather(*build.form_factors, light), gather(pairs, light),
                                model.patches.area),
            1e-3);
}

TEST(Links, SmallerErrorsAreSmaller) {
  const PatchModel& model = furnished().model;
  const FormFactorBlocks pairs(furnished().pairs.exchange, model.patches.area);
  const std::vector<Float3> light = smooth_light(model.patches);
  const std::vector<Float3> truth = gather(pairs, light);
  double last_error = 1;
  for (const double epsilon : {3e-2, 3e-3, 3e-4}) {
    const LinkBuild build = links_of(model, epsilon);
    const double error =
        relative_difference(gather(*build.form_factors, light), truth, model.patches.area);
    EXPECT_LT(error, last_error) << epsilon;
    last_error = error;
  }
}

TEST(Links, AreMadeFinerFromCoarserOnes) {
  const PatchModel& model = furnished().model;
  const RayTracer tracer = test::make_tracer(model);
  const std::vector<Float3> light = smooth_light(model.patches);
  LinkBuilder builder(model, tracer, {});
  const LinkBuild coarse = builder.build(1e-3);
  const LinkBuild finer = builder.build(2e-4), alone = links_of(model, 2e-4);
  const auto count = [](const LinkBuild& build) {
    return static_cast<double>(build.form_factors->link_count());
  };
  // They differ where rows that the coarse links doubted are examined with all rays.
  EXPECT_NEAR(count(finer) / count(alone), 1, 0.05);
  EXPECT_LT(relative_difference(gather(*finer.form_factors, light),
                                gather(*alone.form_factors, light), model.patches.area),
            1e-3);
  // Rays between single patches are most of all, and new links have new ones.
  EXPECT_LT(static_cast<double>(finer.ray_count - coarse.ray_count),
            0.6 * static_cast<double>(alone.ray_count));

  const FormFactorBlocks pairs(furnished().pairs.exchange, model.patches.area);
  const std::vector<Float3> truth = gather(pairs, light);
  const auto error = [&](const LinkBuild& build) {
    return relative_difference(gather(*build.form_factors, light), truth, model.patches.area);
  };
  EXPECT_LT(error(finer), 0.7 * error(coarse));
  EXPECT_LT(error(finer), 1.1 * error(alone));
}

TEST(Links, InFlatArraysGatherTheSame) {
  const auto& [model, build, pairs] = furnished();
  const FormFactorLinks links = flat_links(*build.form_factors);
  EXPECT_EQ(links.pair.size(), build.form_factors->link_count());
  check_links(links, model.patches.size());
  const std::vector<Float3> light = smooth_light(model.patches);
  EXPECT_EQ(gather(LinkedFormFactors(links, model.patches.area, model.patches.centroid), light),
            gather(*build.form_factors, light));
}

TEST(Links, AreForecastFromASample) {
  // More pairs of nodes than the sample in most generations.
  const auto& [model, build, pairs] = furnished();
  const double found = static_cast<double>(build.form_factors->link_count());
  const auto forecast = static_cast<double>(
      forecast_link_count(model, test::make_tracer(model), {.link_epsilon = kLinkEpsilon}));
  RecordProperty("forecast", std::to_string(forecast / found));
  EXPECT_NEAR(forecast / found, 1, 0.2);
}

TEST(Links, NothingGoesThroughAWall) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {3, 3, 3}, true);
  test::add_box(scene, {3.1, 0, 0}, {6.1, 3, 3}, true);
  const PatchModel model = model_of(scene);
  const LinkedFormFactors links = *links_of(model).form_factors;
  std::vector<Float3> light(model.patches.size(), {0, 0, 0});
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (model.patches.centroid[i][0] < 3.05F) light[i] = {1, 1, 1};
  }
  const std::vector<Float3> arrived = gather(links, light);
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (light[i][0] > 0) continue;
    // What links may be wrong by; not a leak that would be seen.
    EXPECT_NEAR(arrived[i][0], 0, kLinkEpsilon) << i;
  }
}

TEST(Links, PatchesThatSeeNothingExchangeNothing) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(scene, {1, 0, 1}, {2.5, 1, 2.5}, false);  // its bottom does not show
  test::remove_face(scene, test::Face::kLowY, 1);
  const PatchModel model = model_of(scene);
  const FormFactorLinks links = flat_links(*links_of(model).form_factors);
  const auto is_under_the_block = [&](std::size_t i) {
    const Float3& p = model.patches.centroid[i];
    return p[1] == 0 && p[0] > 1 && p[0] < 2.5F && p[2] > 1 && p[2] < 2.5F;
  };
  std::vector<Float3> light;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    light.push_back(is_under_the_block(i) ? Float3{1, 1, 1} : Float3{0, 0, 0});
  }
  ASSERT_GT(area_norm(light, model.patches.area), 0);
  for (const FormFactorLinks& some : {links, test::fewer_links(links, model.patches)}) {
    const LinkedFormFactors f(some, model.patches.area, model.patches.centroid);
    EXPECT_EQ(area_norm(gather(f, light), model.patches.area), 0);
    const auto arrived = gather(f, smooth_light(model.patches));
    for (std::size_t i = 0; i < arrived.size(); ++i) {
      if (!is_under_the_block(i)) continue;
      EXPECT_EQ(arrived[i], (Float3{0, 0, 0})) << i;
    }
  }
}

/// Two rooms and a wall with a door, 1 x 2, between them.
Scene rooms_with_a_door() {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {6, 3, 3}, true);
  test::add_box(scene, {2.9, 0, 0}, {3.1, 3, 1}, false);
  test::add_box(scene, {2.9, 0, 2}, {3.1, 3, 3}, false);
  test::add_box(scene, {2.9, 2, 1}, {3.1, 3, 2}, false);
  return scene;
}

TEST(Links, WhatGoesThroughADoorDoes) {
  const PatchModel model = model_of(rooms_with_a_door(), 700);
  const LinkedFormFactors links = *links_of(model).form_factors;
  const FormFactorBlocks pairs(form_factors_of(model).exchange, model.patches.area);
  std::vector<Float3> light(model.patches.size(), {0, 0, 0});
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (model.patches.centroid[i][0] < 2.9F) light[i] = {1, 1, 1};
  }
  const auto through = [&](const FormFactorOperator& form_factors) {
    const std::vector<Float3> arrived = gather(form_factors, light);
    double sum = 0;
    for (std::size_t i = 0; i < light.size(); ++i) {
      if (model.patches.centroid[i][0] > 3.1F) sum += model.patches.area[i] * arrived[i][0];
    }
    return sum;
  };
  const double truth = through(pairs);
  ASSERT_GT(truth, 0.3);
  EXPECT_NEAR(through(links) / truth, 1, 0.02);
}

TEST(Links, AreDimmedByGlass) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 3}, true);
  Material glass = scene.materials[0];
  glass.double_sided = true;
  glass.transmission = 0.5F;
  scene.materials.push_back(glass);
  test::add_polygon(scene, std::array<glm::dvec3, 4>{{{2, 0, 0}, {2, 3, 0}, {2, 3, 3}, {2, 0, 3}}},
                    1);
  const PatchModel model = model_of(scene, 300);
  const FormFactorBlocks pairs(form_factors_of(model).exchange, model.patches.area);
  const LinkBuild build = links_of(model);
  std::vector<Float3> light(model.patches.size(), {0, 0, 0});
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (model.patches.centroid[i][0] < 1e-3F) light[i] = {1, 1, 1};
  }
  EXPECT_LT(relative_difference(gather(*build.form_factors, light), gather(pairs, light),
                                model.patches.area),
            1e-2);
}

TEST(Links, SameBitsForAnyNumberOfThreads) {
  const PatchModel model = model_of(test::furnished_room(), 300);
  const std::vector<Float3> light = smooth_light(model.patches);
  struct Made {
    LinkBuild build;
    std::vector<Float3> gathered;
  };
  const RayTracer tracer = test::make_tracer(model);
  const auto make = [&] {
    LinkBuilder builder(model, tracer, {});
    builder.build(10 * kLinkEpsilon);
    Made made{builder.build(kLinkEpsilon), {}};
    made.gathered = gather(*made.build.form_factors, light);
    return made;
  };
  const Made one = test::with_threads(1, make), three = test::with_threads(3, make);
  const FormFactorLinks of_one = flat_links(*one.build.form_factors),
                        of_three = flat_links(*three.build.form_factors);
  EXPECT_EQ(of_one.pair, of_three.pair);
  EXPECT_EQ(of_one.exchange_area, of_three.exchange_area);
  EXPECT_EQ(of_one.gradient, of_three.gradient);
  EXPECT_EQ(of_one.scale, of_three.scale);
  EXPECT_EQ(one.build.ray_count, three.build.ray_count);
  EXPECT_EQ(one.gathered, three.gathered);
}

TEST(Links, StopWhenAskedTo) {
  const PatchModel model = model_of(test::furnished_room(), 300);
  const RayTracer tracer = test::make_tracer(model);
  EXPECT_THROW(LinkBuilder(model, tracer, {}).build(kLinkEpsilon, [](double) { return false; }),
               Cancelled);
}

TEST(Links, RefuseSettingsOutOfRange) {
  const PatchModel model = model_of(test::furnished_room(), 50);
  const RayTracer tracer = test::make_tracer(model);
  LinkBuilder builder(model, tracer, {});
  EXPECT_THROW(builder.build(0), Error);
  EXPECT_THROW(builder.build(-1), Error);
  builder.build(1e-2);
  EXPECT_THROW(builder.build(1e-2), Error);
  EXPECT_THROW(LinkBuilder(model, tracer, {.probe_rays = 257}), Error);
}

}  // namespace
}  // namespace rebounce::test_links

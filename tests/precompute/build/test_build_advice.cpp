// What a build says of itself when something sticks out.

#include <gtest/gtest.h>

#include <string>

#include "precompute/build/build_advice.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_build_advice {
namespace {

using Lines = std::vector<std::string>;

TransferData two_planes(float reflectance) {
  TransferData data;
  test::add_square(data, 1, 0, 3, true, {reflectance, reflectance, reflectance});
  test::add_square(data, 1, 2, 3, false, {reflectance, reflectance, reflectance});
  test::add_even_exchange(data);
  return data;
}

void expect_one(const Lines& advice, const std::string& what, const std::string& option) {
  ASSERT_EQ(advice.size(), 1U);
  EXPECT_NE(advice[0].find(what), std::string::npos) << advice[0];
  EXPECT_NE(advice[0].find(option), std::string::npos) << advice[0];
}

TEST(BuildAdvice, SaysNothingOfAnOrdinaryScene) {
  BuildReport report;
  report.seconds = {{"form factors", 40}, {"operator", 20}, {"check", 1}};
  EXPECT_EQ(build_advice(two_planes(0.7F), report), Lines{});
}

TEST(BuildAdvice, NamesTheTimeOfFormFactorsInLongBuilds) {
  BuildReport report;
  report.seconds = {{"form factors", 90}, {"operator", 10}};
  expect_one(build_advice(two_planes(0.7F), report), "took 90 % of the time", "--quality low");
  report.seconds = {{"form factors", 9}, {"operator", 1}};
  EXPECT_EQ(build_advice(two_planes(0.7F), report), Lines{});
}

TEST(BuildAdvice, NamesSurfacesThatReflectNearlyAll) {
  expect_one(build_advice(two_planes(0.95F), {}), "reflect 95 %", "--quality high");
  EXPECT_EQ(build_advice(two_planes(0.89F), {}), Lines{});
}

TEST(BuildAdvice, CountsPatchesOfSeveralMaterials) {
  TransferData data = two_planes(0.7F);  // 36 patches of a triangle each
  const std::size_t n = data.patches.size();
  const auto mix = [&](std::uint32_t patch) {
    data.mesh.triangle.push_back(data.mesh.triangle[patch]);
    data.mesh.triangle_patch.push_back(patch);
    data.mesh.triangle_material.push_back(1);
  };
  for (std::uint32_t i = 0; i < n / 3; ++i) mix(i);
  EXPECT_EQ(build_advice(data, {}), Lines{});
  mix(static_cast<std::uint32_t>(n / 3));
  expect_one(build_advice(data, {}), "13 of 36 patches", "--patches");
}

}  // namespace
}  // namespace rebounce::test_build_advice

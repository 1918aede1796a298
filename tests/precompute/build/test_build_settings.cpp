// Settings that are out of their range are refused before the work begins.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "precompute/build/build_decisions.h"
#include "tests/support/expect_error.h"

namespace rebounce::test_build_settings {
namespace {

TEST(BuildSettings, OutOfRangeAreRefused) {
  using Change = std::function<void(BuildSettings&)>;
  const std::vector<std::pair<const char*, Change>> wrong = {
      {"scale must be above 0", [](BuildSettings& s) { s.scale = 0; }},
      {"patches need a number", [](BuildSettings& s) { s.subdivision.patch_count = 0; }},
      {"patches need a number", [](BuildSettings& s) { s.subdivision.patch_size = NAN; }},
      {"weight of lamps", [](BuildSettings& s) { s.subdivision.lamp_weight = -1; }},
      {"the tolerance must be above 0", [](BuildSettings& s) { s.tolerance = 0; }},
      {"the tolerance must be above 0", [](BuildSettings& s) { s.tolerance = NAN; }},
      {"tolerance of form factors", [](BuildSettings& s) { s.form_factor_tolerance = -1; }},
      {"compressed with an operator alone",
       [](BuildSettings& s) {
         s.operator_kind = OperatorKind::kNoOperator;
         s.form_factor_tolerance = 0.01;
       }},
      {"the rank must be",
       [](BuildSettings& s) {
         s.operator_kind = OperatorKind::kLowRank;
         s.rank = 0;
       }},
      {"a grid of probes",
       [](BuildSettings& s) {
         s.probes.grid = {4, 0, 0};
       }},
      {"spacing of probes", [](BuildSettings& s) { s.probes.spacing = -1; }},
      {"a probe needs at least 64 rays", [](BuildSettings& s) { s.probes.ray_count = 63; }},
      {"at least 16 rays", [](BuildSettings& s) { s.surface_harmonics.ray_count = 3; }},
      {"rays per pair must be between", [](BuildSettings& s) { s.form_factors.full_rays = 512; }},
      {"rays per pair must be between", [](BuildSettings& s) { s.form_factors.probe_rays = 0; }},
      {"ray_count must be at least 64", [](BuildSettings& s) { s.receiver_rows.ray_count = 1; }},
  };
  EXPECT_NO_THROW(check_settings({}));
  for (const auto& [message, change] : wrong) {
    BuildSettings settings;
    change(settings);
    test::expect_error([&] { check_settings(settings); }, message);
  }
}

}  // namespace
}  // namespace rebounce::test_build_settings

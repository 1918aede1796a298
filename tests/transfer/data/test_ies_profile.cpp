#include "rebounce/lights.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/expect_error.h"

namespace rebounce::test_ies_profile {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;

// A downlight that is the same all around, then one that has four equal quarters.
const std::string kRound =
    "IESNA:LM-63-2002\r\n[TEST] 1\r\n[MANUFAC] none\r\nTILT=NONE\r\n"
    "1 1000 2 3 1 1 2 0 0 0\r\n0.5 1 60\r\n0 45 90\r\n0\r\n100 50 0\r\n";
const std::string kQuarters =
    "IESNA91\nTILT=INCLUDE\n1\n2\n0 90\n1.0, 0.8\n"
    "1 -1 1 2 3 1 1 0 0 0\n1 1 60\n0 90\n0 45 90\n10 20\n30 40\n50 60\n";

TEST(IesProfile, IsReadWithItsFactors) {
  const auto profile = parse_ies_profile(kRound, "round.ies");
  EXPECT_FLOAT_EQ(profile->intensity(0, 0), 100);
  EXPECT_FLOAT_EQ(profile->intensity(45 * kDegree, 3), 50);
  EXPECT_NEAR(profile->intensity(22.5F * kDegree, -100), 75, 1e-4);
  EXPECT_EQ(profile->intensity(91 * kDegree, 0), 0);
}

TEST(IesProfile, TheBallastLampFactorCountsBefore1995) {
  const auto straight_down = [](std::string text) {
    const std::string from = "0.5 1 60";
    text.replace(text.find(from), from.size(), "0.5 0.8 60");
    return parse_ies_profile(text, "lamp.ies")->intensity(0, 0);
  };
  const std::string rest = kRound.substr(kRound.find('\n') + 1);
  EXPECT_FLOAT_EQ(straight_down(kRound), 100);
  EXPECT_FLOAT_EQ(straight_down("IES:LM-63-2019\n" + rest), 100);
  EXPECT_FLOAT_EQ(straight_down("IESNA91\n" + rest), 80);
  EXPECT_FLOAT_EQ(straight_down(rest), 80);  // 1986 has no such line
}

TEST(IesProfile, QuartersAreMirrored) {
  const auto profile = parse_ies_profile(kQuarters, "quarters.ies");
  const auto at = [&](float around) { return profile->intensity(0, around * kDegree); };
  EXPECT_NEAR(at(0), 10, 1e-4);
  EXPECT_NEAR(at(45), 30, 1e-4);
  EXPECT_NEAR(at(90), 50, 1e-4);
  EXPECT_NEAR(at(135), 30, 1e-4);
  EXPECT_NEAR(at(180), 10, 1e-3);
  EXPECT_NEAR(at(-45), 30, 1e-4);
  EXPECT_NEAR(at(-60), at(60), 1e-3);
}

TEST(IesProfile, WhatIsNoProfileIsRefused) {
  const auto refuse = [](std::string text, const std::string& from, const std::string& to,
                         const std::string& part) {
    if (!from.empty()) {
      const std::size_t at = text.find(from);
      ASSERT_NE(at, std::string::npos) << from;
      text.replace(at, from.size(), to);
    }
    test::expect_error([&] { parse_ies_profile(text, "bad.ies"); }, part);
  };
  refuse("", "", "", "TILT=");
  refuse("not a file at all", "", "", "TILT=");
  refuse(kRound, "TILT=NONE", "tilt", "TILT=");
  refuse(kRound, "1 1000 2 3 1 1", "1 1000 2 3 1 2", "type C");
  refuse(kRound, "1000 2 3 1", "1000 2 0 1", "from 1 to");
  refuse(kRound, "1000 2 3 1", "1000 2 1e9 1", "from 1 to");
  refuse(kRound, "1000 2 3 1", "1000 2 2.5 1", "from 1 to");
  refuse(kRound, "0 45 90", "0 90 45", "out of order");
  refuse(kRound, "0 45 90", "-0.009 -0.005 90", "out of order");
  refuse(kRound, "0 45 90", "0 45 200", "outside");
  refuse(kRound, "100 50 0", "100 50", "candela value");
  refuse(kRound, "100 50 0", "100 nan 0", "candela value");
  refuse(kRound, "100 50 0", "100 -5 0", "negative");
  refuse(kRound, "1000 2 3", "1000 -2 3", "negative multiplier");
  refuse(kRound, "1000 2 3", "1000 2e38 3", "too large");
  refuse(kQuarters, "0 45 90", "0 45 80", "90, 180 or 360");
  refuse(kQuarters, "0 45 90", "5 45 90", "begin with 0");
}

TEST(IesProfile, AnyPrefixOfAFileIsRefusedOrRead) {
  std::size_t refused = 0;
  for (std::size_t length = 0; length < kQuarters.size(); ++length) {
    try {
      parse_ies_profile(std::string_view(kQuarters).substr(0, length), "cut.ies");
    } catch (const Error& error) {
      ++refused;
      EXPECT_NE(std::string(error.what()).find("cut.ies"), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(refused, kQuarters.size() / 2);
}

}  // namespace
}  // namespace rebounce::test_ies_profile

// What the report concludes from measured times: sweeps that fit into a frame, and lag.

#include <gtest/gtest.h>

#include "bench/report/accuracy.h"
#include "bench/report/frames.h"

namespace rebounce::bench::test_frame_times {
namespace {

TEST(LagAfter, CountsFramesUntilTheErrorIsSmall) {
  const std::vector<float> errors = {0, 0.5F, 0.1F, 0.001F, 0, 0.2F, 0.2F, 0.2F};
  const Lag lag = lag_after({1, 5}, errors, 0.01);
  EXPECT_DOUBLE_EQ(lag.mean, 2.5);  // two, and three until the end
  EXPECT_EQ(lag.worst, 3);
  EXPECT_EQ(lag.never, 1);
  EXPECT_EQ(lag_after({4}, errors, 0.01).worst, 0);
  EXPECT_EQ(lag_after({1}, {0, 0.5F, 0.001F}, 0.01).never, 0);
}

TEST(RunTimes, AreALineThroughWhatWasMeasuredThatOutliersDoNotTurn) {
  std::vector<AccuracyRow> rows;
  for (const int sweeps : {1, 2, 3, 4, 8, 16}) {
    const double disturbed = sweeps == 3 ? 50 : 1;
    rows.push_back({.contestant = 1,
                    .change = "switched",
                    .sweeps = sweeps,
                    .time = {.median = disturbed * (10 + 5 * sweeps) * 1e-6}});
  }
  rows.push_back({.contestant = 0, .change = "switched", .time = {.median = 80e-6}});
  const std::vector<RunTime> times = run_times(rows, 2);
  EXPECT_NEAR(times[1].start, 10, 1e-6);
  EXPECT_NEAR(times[1].sweep, 5, 1e-6);
  EXPECT_EQ(times[1].sweeps_within(14), 0);
  EXPECT_EQ(times[1].sweeps_within(36), 5);
  EXPECT_EQ(times[0].sweeps_within(79), 0);
  EXPECT_EQ(times[0].sweeps_within(80), 1);
}

}  // namespace
}  // namespace rebounce::bench::test_frame_times

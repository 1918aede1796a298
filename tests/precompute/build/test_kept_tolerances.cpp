#include "precompute/build/kept_tolerances.h"

#include <gtest/gtest.h>

#include "tests/support/expect_error.h"

namespace rebounce::test_kept_tolerances {
namespace {

BuildRecord record_of(double tolerance, double mean, double max) {
  BuildRecord record;
  record.tolerance = tolerance;
  record.error_mean = mean;
  record.error_max = max;
  return record;
}

TEST(KeptTolerances, TheMeanAndThreeTimesAsMuchForSingleLampsPass) {
  EXPECT_NO_THROW(check_tolerances(record_of(0.005, 0.0049, 0.0149), {}, false));
}

TEST(KeptTolerances, WithoutAToleranceNothingIsPromised) {
  EXPECT_NO_THROW(check_tolerances(record_of(0, 0.1, 0.9), {}, false));
}

TEST(KeptTolerances, AMeanAboveTheToleranceIsSaid) {
  test::expect_error([] { check_tolerances(record_of(0.005, 0.0051, 0.006), {}, false); },
                     "misses its tolerance: the mean error is 0.0051, the tolerance 0.005");
}

TEST(KeptTolerances, ALampAboveThreeTimesTheToleranceIsSaid) {
  test::expect_error([] { check_tolerances(record_of(0.005, 0.004, 0.0151), {}, false); },
                     "the largest error of the check is 0.015, three times the tolerance is 0.015");
}

TEST(KeptTolerances, AFinerOperatorIsTriedWhereItHelps) {
  EXPECT_EQ(finer_tolerance(record_of(0.005, 0.004, 0.0149)), 0);
  EXPECT_NEAR(finer_tolerance(record_of(0.005, 0.004, 0.018)), 0.00375, 1e-9);
  EXPECT_EQ(finer_tolerance(record_of(0.005, 0.004, 0.06)), 0);
  EXPECT_EQ(finer_tolerance(record_of(0, 0, 0)), 0);
}

TEST(KeptTolerances, FormFactorsAboveTheirsAreSaid) {
  BuildReport report;
  report.form_factor_tolerance = 0.001;
  report.form_factor_error = FormFactorError{.mean = 0.0011, .max = 0.002};
  const BuildRecord record = record_of(0.005, 0.004, 0.01);
  EXPECT_NO_THROW(check_tolerances(record, report, false));
  test::expect_error([&] { check_tolerances(record, report, true); }, "miss their tolerance");
}

}  // namespace
}  // namespace rebounce::test_kept_tolerances

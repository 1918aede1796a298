#include "precompute/build/kept_tolerances.h"

#include <fmt/format.h>

#include "precompute/lights/validation_error.h"
#include "rebounce/error.h"

namespace rebounce {

double finer_tolerance(const BuildRecord& record) {
  // Below half of the tolerance operators get too large for one lamp; lab/115.
  constexpr double kMargin = 0.9, kLeastPart = 0.5;
  const double limit = kLargestOverMean * record.tolerance;
  if (record.error_max <= limit) return 0;
  const double part = kMargin * limit / record.error_max;
  return part >= kLeastPart ? part * record.tolerance : 0;
}

void check_tolerances(const BuildRecord& record, const BuildReport& report, bool has_form_factors) {
  if (record.tolerance > 0 && record.error_mean > record.tolerance) {
    throw Error(fmt::format(
        "the operator misses its tolerance: the mean error is {:.2g}, the tolerance {:.2g}; the "
        "file is written: raise --tolerance, or use --precision f32 or --operator dense",
        record.error_mean, record.tolerance));
  }
  if (record.tolerance > 0 && record.error_max > kLargestOverMean * record.tolerance) {
    throw Error(fmt::format(
        "the operator errs too much under single lamps: the largest error of the check is {:.2g}, "
        "three times the tolerance is {:.2g}; the file is written: count it as one of tolerance "
        "{:.2g}, or try another --seed or --operator dense",
        record.error_max, kLargestOverMean * record.tolerance,
        record.error_max / kLargestOverMean));
  }
  if (record.tolerance > 0 && report.whole_error &&
      report.whole_error->whole.mean > record.tolerance) {
    const SampledError &whole = report.whole_error->whole, &links = report.whole_error->links;
    throw Error(fmt::format(
        "links and compression together miss the tolerance: the mean error is {:.2g}, the "
        "tolerance {:.2g}; that of compression alone is {:.2g}, that of links {:.2g}; the file is "
        "written: count it as one of tolerance {:.2g}, or take a smaller --link-epsilon or "
        "--form-factors pairs",
        whole.mean, record.tolerance, record.error_mean, links.mean, whole.mean));
  }
  if (has_form_factors && report.form_factor_error->mean > report.form_factor_tolerance) {
    throw Error(fmt::format(
        "the compressed form factors miss their tolerance: the mean error is {:.2g}, the tolerance "
        "{:.2g}; the file is written: raise --compress-form-factors, or leave it out",
        report.form_factor_error->mean, report.form_factor_tolerance));
  }
}

}  // namespace rebounce

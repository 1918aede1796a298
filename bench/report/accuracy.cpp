#include "bench/report/accuracy.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "bench/report/in_parallel.h"
#include "bench/support/read_buffer.h"
#include "bench/support/reflected_light.h"
#include "rebounce/error.h"

namespace rebounce::bench {
namespace {

/// An iteration that is this near to its own solution has converged for the report, and so has one
/// whose own solution is off by many times what is left.
constexpr double kConverged = 3e-5, kLeftOfError = 0.05;

/// The run of a lamp ends at this part of both, so that the mean over lamps goes on as if none had.
constexpr double kPartOfALamp = 1.0 / 3;

/// Iterations are looked at after each sweep, up to so many.
constexpr int kMostSweeps = 100;

/// An iteration whose error is above this part of that two sweeps before has stalled or diverged,
/// but for the first sweeps, after which light may still be on its way.
constexpr double kStalled = 0.98;
constexpr std::size_t kFirstSweeps = 6;

/// More than the caches of most processors hold.
constexpr std::size_t kCacheBytes = std::size_t{96} << 20;

/// Samples of cases that take less are means over as many runs as take this long, seconds.
constexpr double kSampleSeconds = 1e-3;

/// Runs are timed after so many sweeps, and after others the line through these says.
constexpr std::array kTimedSweeps = {1, 2, 6};

/// Sweeps of one frame at most.
constexpr int kMostFrameSweeps = 64;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The line through times by sweeps whose slope is the median of those of all pairs (P. K. Sen,
/// "Estimates of the regression coefficient based on Kendall's tau", 1968): a time that was
/// disturbed does not turn it.
RunTime fit(const std::map<int, double>& time_by_sweeps) {
  std::vector<double> slopes, starts;
  for (auto a = time_by_sweeps.begin(); a != time_by_sweeps.end(); ++a) {
    for (auto b = std::next(a); b != time_by_sweeps.end(); ++b) {
      slopes.push_back((b->second - a->second) / (b->first - a->first));
    }
  }
  const auto& [sweeps, time] = *time_by_sweeps.begin();
  if (slopes.empty()) return {0, time / sweeps};
  const double slope = std::max(0.0, median(slopes));
  for (const auto& [k, t] : time_by_sweeps) starts.push_back(t - k * slope);
  return {std::max(0.0, median(starts)), slope};
}

class AccuracyBench {
 public:
  AccuracyBench(const Contenders& contenders, const std::vector<Contestant>& contestants,
                const ReportSettings& settings, const ReportProgress& progress)
      : contenders_(contenders),
        contestants_(contestants),
        settings_(settings),
        progress_(progress),
        cases_(make_light_cases(contenders, settings, progress)) {
    for (const Form& form : contenders.forms) {
      own_[form.name] = solve_on(form, contenders, cases_, progress);
    }
  }

  std::vector<AccuracyRow> measure() {
    std::vector<std::vector<AccuracyRow>> rows(contestants_.size());
    const Progress part = [this](double done) { return progress_("errors", done); };
    in_parallel(contestants_.size(), part, [&](std::size_t k) { rows[k] = errors_of(k); });
    std::vector<AccuracyRow> all;
    for (auto& of_contestant : rows) std::ranges::move(of_contestant, std::back_inserter(all));
    time(all);
    return all;
  }

 private:
  /// What is timed: a contestant, and whether it starts in the dark.
  using Start = std::pair<std::size_t, bool>;
  /// A timed run, and how many sweeps it is asked for.
  using TimeKey = std::pair<Start, int>;
  struct TimedRun {
    int sweeps = 0;  ///< that it made; fewer than asked for where single precision ends
    Timing timing{};
  };

  /// A case's solution on the contestant's own form of F.
  const std::vector<Float3>& own_solution(const Contestant& contestant, std::size_t k) const {
    return own_.at(contestant.form)[k];
  }

  void begin(const Contestant& contestant, std::size_t k, Method& method) const {
    method.set_reflectance(cases_[k].reflectance);
    if (cases_[k].cold) {
      method.reset();
    } else if (method.iterates()) {
      // Every change of a lamp begins where its first one, from zero, ends.
      method.start_from(own_solution(contestant, k % settings_.lamp_count));
    }
  }

  std::vector<AccuracyRow> errors_of(std::size_t contestant) const {
    const auto method = contestants_[contestant].make(contenders_);
    std::vector<AccuracyRow> rows;
    const auto lamp_count = static_cast<std::size_t>(settings_.lamp_count);
    for (std::size_t first = 0; first < cases_.size(); first += lamp_count) {
      // Wherever iterations start from, a product is the same.
      const bool again = !rows.empty() && rows.back().change == cases_[first].change;
      if (!method->iterates() && again) continue;
      std::vector<Course> courses;
      for (std::size_t k = first; k < first + lamp_count; ++k) {
        courses.push_back(course_of(contestant, k, *method));
      }
      add_rows(contestant, first, method->iterates(), courses, rows);
    }
    return rows;
  }

  /// The errors of one lamp after each sweep, as far as it was looked at, or after the product.
  struct Course {
    std::vector<double> error, iteration_error;
  };

  Course course_of(std::size_t contestant, std::size_t k, Method& method) const {
    Course course;
    const auto error = [&](std::span<const Float3> radiosity, const std::vector<Float3>& truth) {
      return reflected_error(radiosity, truth, cases_[k].after, contenders_.data->patches.area);
    };
    const auto look = [&](std::span<const Float3> radiosity) {
      course.error.push_back(error(radiosity, cases_[k].truth));
      course.iteration_error.push_back(
          method.iterates() ? error(radiosity, own_solution(contestants_[contestant], k))
                            : course.error.back());
      const double left = course.iteration_error.back() / kPartOfALamp;
      return !has_converged(left, course.error.back()) && !has_stalled(course.iteration_error);
    };
    begin(contestants_[contestant], k, method);
    method.watch(cases_[k].after, kMostSweeps, look);
    if (course.error.empty()) look(method.radiosity());  // no light, no sweeps
    return course;
  }

  static bool has_converged(double iteration_error, double error) {
    return iteration_error < std::max(kConverged, kLeftOfError * error);
  }

  static bool has_stalled(const std::vector<double>& errors) {
    return errors.size() > kFirstSweeps && !(errors.back() < kStalled * errors[errors.size() - 3]);
  }

  /// A row for each number of sweeps until the mean over the lamps has converged, of the change
  /// whose first case is `first`. A lamp that has ended stays as it is.
  void add_rows(std::size_t contestant, std::size_t first, bool iterates,
                const std::vector<Course>& courses, std::vector<AccuracyRow>& rows) const {
    std::size_t most = 0;
    for (const Course& course : courses) most = std::max(most, course.error.size());
    for (std::size_t look = 0; look < most; ++look) {
      AccuracyRow row{.contestant = contestant,
                      .change = cases_[first].change,
                      .sweeps = iterates ? static_cast<int>(look) + 1 : 0,
                      .cold = iterates && cases_[first].cold};
      for (const Course& course : courses) {
        const std::size_t at = std::min(look, course.error.size() - 1);
        row.error += course.error[at] / settings_.lamp_count;
        row.error_max = std::max(row.error_max, course.error[at]);
        row.iteration_error += course.iteration_error[at] / settings_.lamp_count;
      }
      rows.push_back(row);
      if (has_converged(row.iteration_error, row.error)) break;
    }
  }

  static Start start_of(const AccuracyRow& row) { return {row.contestant, row.cold}; }

  /// Adds the times, each found once for all rows that share it.
  void time(std::vector<AccuracyRow>& rows) const {
    std::map<TimeKey, TimedRun> warm, cold;
    for (const AccuracyRow& r : rows) {
      if (r.sweeps == 0) warm[{start_of(r), 0}] = {};
      for (const int sweeps : kTimedSweeps) {
        if (r.sweeps > 0) warm[{start_of(r), sweeps}] = {};
      }
    }
    cold = warm;
    const int threads = omp_get_max_threads();
    omp_set_num_threads(settings_.solve_threads);
    fill_in(warm, false);
    fill_in(cold, true);
    omp_set_num_threads(threads);
    for (AccuracyRow& r : rows) {
      r.time = time_of(r, warm);
      r.cold_time = time_of(r, cold);
    }
  }

  /// Of a product as it was timed; of an iteration by the line through what was.
  static Timing time_of(const AccuracyRow& row, const std::map<TimeKey, TimedRun>& times) {
    if (row.sweeps == 0) return times.at({start_of(row), 0}).timing;
    std::map<int, double> by_sweeps;
    Timing result;
    for (const int sweeps : kTimedSweeps) {
      const TimedRun& run = times.at({start_of(row), sweeps});
      by_sweeps[run.sweeps] = run.timing.median;
      result.spread = std::max(result.spread, run.timing.spread);
    }
    const RunTime line = fit(by_sweeps);
    result.median = line.start + row.sweeps * line.sweep;
    return result;
  }

  void fill_in(std::map<TimeKey, TimedRun>& times, bool cold_caches) const {
    const char* phase = cold_caches ? "times with cold caches" : "times";
    if (!progress_(phase, 0)) throw Cancelled();
    ReadBuffer other_work(cold_caches ? kCacheBytes : 0);
    std::vector<std::unique_ptr<Method>> methods;
    for (const Contestant& contestant : contestants_)
      methods.push_back(contestant.make(contenders_));
    std::vector<TimedCase> timed;
    std::size_t begun = 0;
    for (auto& [key, timed_run] : times) {
      const auto [start, sweeps] = key;
      const auto [contestant, cold] = start;
      Method& method = *methods[contestant];
      const std::size_t k = cold ? 0 : static_cast<std::size_t>(settings_.lamp_count);
      timed.push_back(
          {.work = [this, &method, k, sweeps = sweeps,
                    &made = timed_run.sweeps] { made = method.run(cases_[k].after, sweeps); },
           .prepare =
               [this, &method, &other_work, &begun, &times, contestant = contestant, k, cold_caches,
                phase] {
                 begin(contestants_[contestant], k, method);
                 if (!cold_caches) return;
                 other_work.read();
                 const double part = static_cast<double>(++begun) /
                                     static_cast<double>(times.size()) / (settings_.repeats + 1);
                 if (!progress_(phase, std::min(part, 1.0))) throw Cancelled();
               },
           .repeat_prepared = !cold_caches});
    }
    const std::vector<Timing> found =
        time_interleaved(timed, {.rounds = settings_.repeats, .sample_seconds = kSampleSeconds});
    std::size_t k = 0;
    for (auto& [key, timed_run] : times) timed_run.timing = found[k++];
  }

  const Contenders& contenders_;
  const std::vector<Contestant>& contestants_;
  const ReportSettings& settings_;
  const ReportProgress& progress_;
  std::vector<LightCase> cases_;
  std::map<std::string, std::vector<std::vector<Float3>>> own_;  ///< by form; solve_on
};

}  // namespace

int RunTime::sweeps_within(double microseconds) const {
  if (sweep <= 0) return start <= microseconds ? 1 : 0;
  const double fit = std::floor((microseconds - start) / sweep);
  return static_cast<int>(std::clamp(fit, 0.0, static_cast<double>(kMostFrameSweeps)));
}

std::vector<AccuracyRow> measure_accuracy(const Contenders& contenders,
                                          const std::vector<Contestant>& contestants,
                                          const ReportSettings& settings,
                                          const ReportProgress& progress) {
  return AccuracyBench(contenders, contestants, settings, progress).measure();
}

std::vector<RunTime> run_times(const std::vector<AccuracyRow>& rows, std::size_t contestant_count) {
  std::vector<RunTime> times(contestant_count);
  std::vector<std::map<int, double>> by_sweeps(contestant_count);
  for (const AccuracyRow& row : rows) {
    if (row.sweeps == 0) times[row.contestant].start = row.time.median * 1e6;
    if (row.sweeps > 0 && !row.cold) {
      by_sweeps[row.contestant][row.sweeps] = row.time.median * 1e6;
    }
  }
  for (std::size_t k = 0; k < contestant_count; ++k) {
    if (!by_sweeps[k].empty()) times[k] = fit(by_sweeps[k]);
  }
  return times;
}

}  // namespace rebounce::bench

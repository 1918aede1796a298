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

/// Iterations are looked at after each sweep, up to so many. Those that begin anew for each look
/// are looked at after each of the first, and then at steps of an eighth.
constexpr int kMostSweeps = 100, kMostAnew = 48, kEachAnew = 16, kStepAnew = 8;

/// An iteration whose error is above this part of that two looks before has stalled or diverged.
constexpr double kStalled = 0.98;

/// More than the caches of most processors hold.
constexpr std::size_t kCacheBytes = std::size_t{96} << 20;

/// Samples of cases that take less are means over as many runs as take this long, seconds.
constexpr double kSampleSeconds = 1e-3;

/// Runs are timed after so many sweeps, and after others the line through these says.
constexpr std::array kTimedSweeps = {1, 2, 6};

/// Sweeps of one frame at most.
constexpr int kMostFrameSweeps = 64;

/// The number of sweeps after which an iteration is looked at next.
int next_look(int sweeps, bool anew) {
  return anew && sweeps >= kEachAnew ? sweeps + sweeps / kStepAnew : sweeps + 1;
}

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

  /// A solution that a run goes on from.
  struct Cut {
    int sweeps = 0;
    std::vector<Float3> radiosity;
  };

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
    for (std::size_t first = 0; first < cases_.size();
         first += static_cast<std::size_t>(settings_.lamp_count)) {
      std::vector<Cut> cuts(settings_.lamp_count);
      if (!method->iterates()) {
        // Wherever iterations start from, a product is the same.
        if (rows.empty() || rows.back().change != cases_[first].change) {
          rows.push_back(row(contestant, first, 0, *method, cuts));
        }
        continue;
      }
      const bool anew = contestants_[contestant].sweeps_of_cuts() == 0;
      std::vector<double> errors;
      const int most = anew ? kMostAnew : kMostSweeps;
      for (int sweeps = 1; sweeps <= most; sweeps = next_look(sweeps, anew)) {
        rows.push_back(row(contestant, first, sweeps, *method, cuts));
        errors.push_back(rows.back().iteration_error);
        if (has_converged(rows.back()) || has_stalled(errors)) break;
      }
    }
    return rows;
  }

  /// Finds the solution of a case after `sweeps`, from the last cut.
  void run(std::size_t contestant, std::size_t k, int sweeps, Method& method, Cut& cut) const {
    begin(contestants_[contestant], k, method);
    if (cut.sweeps > 0) method.start_from(cut.radiosity);
    method.run(cases_[k].after, sweeps - cut.sweeps);
    const int period = contestants_[contestant].sweeps_of_cuts();
    if (period == 0 || sweeps % period != 0) return;
    cut.sweeps = sweeps;
    cut.radiosity.assign(method.radiosity().begin(), method.radiosity().end());
  }

  /// Over the lamps of the change whose first case is `first`; `cuts` are theirs.
  AccuracyRow row(std::size_t contestant, std::size_t first, int sweeps, Method& method,
                  std::vector<Cut>& cuts) const {
    AccuracyRow result{.contestant = contestant,
                       .change = cases_[first].change,
                       .sweeps = sweeps,
                       .cold = method.iterates() && cases_[first].cold};
    for (std::size_t k = first; k < first + settings_.lamp_count; ++k) {
      run(contestant, k, sweeps, method, cuts[k - first]);
      const auto error = [&](const std::vector<Float3>& truth) {
        return reflected_error(method.radiosity(), truth, cases_[k].after,
                               contenders_.data->patches.area);
      };
      const double against_reference = error(cases_[k].truth);
      result.error += against_reference / settings_.lamp_count;
      result.error_max = std::max(result.error_max, against_reference);
      result.iteration_error +=
          (method.iterates() ? error(own_solution(contestants_[contestant], k))
                             : against_reference) /
          settings_.lamp_count;
    }
    return result;
  }

  static bool has_converged(const AccuracyRow& row) {
    return row.iteration_error < std::max(kConverged, kLeftOfError * row.error);
  }

  static bool has_stalled(const std::vector<double>& errors) {
    return errors.size() > 2 && !(errors.back() < kStalled * errors[errors.size() - 3]);
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

#include "bench/solve/solve_times.h"

#include <array>

#include "bench/support/input.h"
#include "bench/support/reflected_light.h"
#include "bench/support/timing.h"
#include "runtime/solvers/solve_radiosity.h"

namespace rebounce::bench {
namespace {

constexpr std::array<double, 3> kErrors = {0.01, 0.001, 0.0001};
constexpr int kMostSweeps = 64;

bool is_exact(const Form& form) {
  return form.name == kExactRows || form.name == kExactHalf;
}

/// Jacobi is gathering by another name.
bool suits(SolveMethod method, const Form& form, const TransferData& data) {
  if (method == SolveMethod::kJacobi) return false;
  if (needs_operator(method) && !data.transfer) return false;
  const bool by_rows =
      method == SolveMethod::kGaussSeidel || method == SolveMethod::kSymmetricGaussSeidel;
  return !by_rows || dynamic_cast<const SweepableFormFactors*>(form.form_factors.get()) != nullptr;
}

SolveSettings exactly(int sweeps) {
  return {.max_sweeps = sweeps, .residual = 0, .measure_residual = false};
}

class SolveBench {
 public:
  SolveBench(const TransferData& data, std::span<const Form> forms, int rounds, Table& table)
      : data_(data), forms_(forms), rounds_(rounds), table_(table) {}

  void measure_product(const LightChange& change) {
    std::vector<Float3> result(data_.patches.size());
    std::vector<float> workspace(data_.transfer->workspace_size());
    const std::vector<TimedCase> cases = {
        {.work = [&] { data_.transfer->apply(change.after, result, workspace); }}};
    const Timing time = time_interleaved(cases, {.rounds = rounds_})[0];
    std::vector<Table::Cell> row = {
        scene_name(data_),       data_.patches.size(), data_.transfer->kind(), "transfer", "any",
        data_.record.error_mean, Table::Cell(),        time.median * 1e6};
    row.resize(row.size() + 2 * (kErrors.size() - 1));
    table_.add(std::move(row));
  }

  void measure(const Form& form, const LightChange& change) {
    const std::vector<Float3> truth = solution(form, change.after);
    const std::vector<Float3> before =
        change.before.empty() ? change.before : solution(form, change.before);
    const Table::Cell form_error = error_of_form(form, change.after, truth);
    for (const NamedSolveMethod& named : kSolveMethods) {
      if (!suits(named.method, form, data_)) continue;
      const auto solver = make_solver(named.method, *form.form_factors, problem(), data_.transfer);
      const auto prepare = [&] {
        if (before.empty()) {
          solver->reset();
        } else {
          solver->start_from(before);
        }
      };
      const std::vector<int> needed = count_sweeps(*solver, prepare, change.after, truth);
      std::vector<TimedCase> cases;
      for (const int sweeps : needed) {
        cases.push_back({.work = [&, sweeps] { solver->solve(change.after, exactly(sweeps)); },
                         .prepare = prepare});
      }
      const std::vector<Timing> timings = time_interleaved(cases, {.rounds = rounds_});
      std::vector<Table::Cell> row = {scene_name(data_),       data_.patches.size(), form.name,
                                      std::string(named.name), change.name,          form_error};
      for (std::size_t k = 0; k < kErrors.size(); ++k) {
        row.push_back(k < needed.size() ? Table::Cell(needed[k]) : Table::Cell());
        row.push_back(k < needed.size() ? Table::Cell(timings[k].median * 1e6) : Table::Cell());
      }
      table_.add(std::move(row));
    }
  }

 private:
  RadiosityProblem problem() const { return {data_.patches.area, data_.patches.reflectance}; }

  std::vector<Float3> solution(const Form& form, const std::vector<Float3>& light) const {
    std::vector<Float3> radiosity(light.size());
    solve_radiosity(SolveMethod::kConjugateGradient, *form.form_factors, problem(), light,
                    {.max_sweeps = 1000, .residual = 1e-7}, radiosity);
    return radiosity;
  }

  double error(std::span<const Float3> radiosity, const std::vector<Float3>& truth,
               const std::vector<Float3>& light) const {
    return reflected_error(radiosity, truth, light, data_.patches.area);
  }

  /// The fewest sweeps to each of kErrors that is reached.
  template <typename Prepare>
  std::vector<int> count_sweeps(RadiositySolver& solver, const Prepare& prepare,
                                const std::vector<Float3>& light,
                                const std::vector<Float3>& truth) const {
    std::vector<int> needed;
    for (int sweeps = 1; sweeps <= kMostSweeps && needed.size() < kErrors.size(); ++sweeps) {
      prepare();
      solver.solve(light, exactly(sweeps));
      const double e = error(solver.radiosity(), truth, light);
      while (needed.size() < kErrors.size() && e <= kErrors[needed.size()]) {
        needed.push_back(sweeps);
      }
    }
    return needed;
  }

  /// What the form itself adds: the error of its solution against that of the F of all pairs.
  Table::Cell error_of_form(const Form& form, const std::vector<Float3>& light,
                            const std::vector<Float3>& truth) const {
    if (is_exact(form)) return 0.0;
    for (const Form& other : forms_) {
      if (is_exact(other)) return error(truth, solution(other, light), light);
    }
    return {};
  }

  const TransferData& data_;
  std::span<const Form> forms_;
  int rounds_;
  Table& table_;
};

}  // namespace

Table make_solve_table() {
  return Table({"scene", "patches", "form", "method", "light", "form error", "sweeps 1 %", "us 1 %",
                "sweeps 0.1 %", "us 0.1 %", "sweeps 0.01 %", "us 0.01 %"});
}

void measure_solves(const TransferData& data, std::span<const Form> forms,
                    std::span<const LightChange> changes, int rounds, Table& table) {
  SolveBench bench(data, forms, rounds, table);
  if (data.transfer) bench.measure_product(changes.front());
  for (const Form& form : forms) {
    for (const LightChange& change : changes) bench.measure(form, change);
  }
}

}  // namespace rebounce::bench

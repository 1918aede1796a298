// Every iterative method against dense elimination, on systems made by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "rebounce/error.h"
#include "runtime/solvers/conjugate_gradient_solver.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/exchange_samples.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scene_data.h"
#include "tests/support/thread_pool.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/reflection.h"
#include "transfer/exchange/exchange_blocks.h"
#include "transfer/exchange/form_factor_blocks.h"

namespace rebounce::test_solvers {
namespace {

constexpr std::size_t kPatchCount = 300;  // two groups of Gauss-Seidel, the second not full

/// A closed system of patches of random sizes, of which each pair sees each other by chance; row
/// sums are at most 1. Not physics, but matrices with the right structure.
struct System {
  std::vector<float> area;
  std::vector<Float3> reflectance, initial_exitance;
  ExchangeMatrix exchange;

  explicit System(float largest_reflectance, std::size_t n = kPatchCount) {
    std::mt19937_64 engine(7);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (std::size_t i = 0; i < n; ++i) {
      area.push_back(0.1F + uniform(engine));
      reflectance.push_back({largest_reflectance, largest_reflectance * uniform(engine), 0});
      if (i % 5 == 0) reflectance.back() = {0, 0, 0};
      initial_exitance.push_back({uniform(engine), i % 50 == 0 ? 30.0F : 0.0F, uniform(engine)});
    }
    std::vector<double> row_sum(n, 0);
    std::vector<std::uint64_t> begin = {0};
    std::vector<std::uint32_t> column;
    std::vector<float> value;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        if (uniform(engine) < 0.3F) continue;
        column.push_back(static_cast<std::uint32_t>(j));
        value.push_back(area[i] * area[j] * uniform(engine));
        row_sum[i] += value.back() / area[i];
        row_sum[j] += value.back() / area[j];
      }
      begin.push_back(column.size());
    }
    const double largest = *std::ranges::max_element(row_sum);
    for (float& s : value) s = static_cast<float>(s / largest);
    exchange = {SharedArray(std::move(begin)), SharedArray(std::move(column)),
                SharedArray(std::move(value))};
  }

  RadiosityProblem problem() const { return {area, reflectance}; }

  /// Gauss elimination in double precision, without pivots: the matrix is diagonally dominant.
  std::vector<Float3> eliminate() const {
    const std::size_t n = area.size();
    const FormFactorRows rows(exchange, area);
    std::vector<Float3> solution(n);
    for (int c = 0; c < kChannelCount; ++c) {
      std::vector<double> matrix(n * n, 0.0), right(n);
      for (std::size_t i = 0; i < n; ++i) {
        matrix[i * n + i] = 1;
        right[i] = initial_exitance[i][c];
        for (std::size_t k = 0; k < rows.columns(i).size(); ++k) {
          matrix[i * n + rows.columns(i)[k]] =
              -static_cast<double>(reflectance[i][c]) * rows.form_factors(i)[k];
        }
      }
      for (std::size_t p = 0; p < n; ++p) {
        for (std::size_t i = p + 1; i < n; ++i) {
          const double factor = matrix[i * n + p] / matrix[p * n + p];
          if (factor == 0) continue;
          for (std::size_t j = p; j < n; ++j) matrix[i * n + j] -= factor * matrix[p * n + j];
          right[i] -= factor * right[p];
        }
      }
      for (std::size_t i = n; i-- > 0;) {
        for (std::size_t j = i + 1; j < n; ++j) right[i] -= matrix[i * n + j] * right[j];
        right[i] /= matrix[i * n + i];
        solution[i][c] = static_cast<float>(right[i]);
      }
    }
    return solution;
  }
};

/// Y by its own series, F + F rho F + ..., times `scale`: a stored operator that is as wrong as a
/// test wants it.
class SeriesOperator final : public TransferOperator {
 public:
  SeriesOperator(const FormFactorBlocks& form_factors, std::vector<Float3> reflectance,
                 float scale = 1)
      : form_factors_(form_factors), reflectance_(std::move(reflectance)), scale_(scale) {}

  std::size_t patch_count() const override { return form_factors_.patch_count(); }
  std::size_t bytes() const override { return form_factors_.bytes(); }
  OperatorKind kind() const override { return OperatorKind::kNoOperator; }
  std::size_t workspace_size() const override {
    return form_factors_.workspace_size() + kChannelCount * patch_count();
  }
  void do_apply(std::span<const Float3> initial_exitance, std::span<Float3> indirect_irradiance,
                std::span<float> workspace, const Scheduler& scheduler) const override {
    const std::size_t n = patch_count();
    const std::span<Float3> b(reinterpret_cast<Float3*>(workspace.data()), n);
    std::ranges::copy(initial_exitance, b.begin());
    for (int bounce = 0; bounce < 40; ++bounce) {
      form_factors_.gather(b, indirect_irradiance, workspace.subspan(kChannelCount * n), scheduler);
      add_reflected(initial_exitance, reflectance_, indirect_irradiance, b);
    }
    for (Float3& h : indirect_irradiance) {
      for (float& x : h) x *= scale_;
    }
  }

 private:
  const FormFactorBlocks& form_factors_;
  std::vector<Float3> reflectance_;
  float scale_;
};

enum class Form : std::uint8_t { kBlocks, kExchange, kCompressed };

std::unique_ptr<const FormFactorOperator> make_form(Form form, const System& system) {
  switch (form) {
    case Form::kBlocks:
      return std::make_unique<FormFactorBlocks>(system.exchange, system.area);
    case Form::kExchange:
      return std::make_unique<ExchangeBlocks>(system.exchange, system.area);
    case Form::kCompressed:
      return std::make_unique<CompressedFormFactors>(
          test::dense_blocks(system.exchange, system.area));
  }
  return nullptr;
}

struct Case {
  System system;
  FormFactorBlocks blocks;
  std::unique_ptr<const FormFactorOperator> form_factors;
  std::shared_ptr<const TransferOperator> operator_;

  explicit Case(float largest_reflectance, Form form = Form::kBlocks)
      : system(largest_reflectance),
        blocks(system.exchange, system.area),
        form_factors(make_form(form, system)),
        operator_(std::make_shared<SeriesOperator>(blocks, system.reflectance, 1.03F)) {}

  std::unique_ptr<RadiositySolver> solver(SolveMethod method) const {
    return make_solver(method, *form_factors, system.problem(), operator_);
  }
  double error(std::span<const Float3> radiosity, const std::vector<Float3>& truth) const {
    return relative_difference(radiosity, truth, system.area);
  }
};

constexpr SolveSettings kTight = {.max_sweeps = 400, .residual = 3e-7};

std::vector<Float3> copy(std::span<const Float3> values) {
  return {values.begin(), values.end()};
}

struct MethodAndForm {
  NamedSolveMethod named;
  Form form;
};

/// Each method on each form of F that it takes.
std::vector<MethodAndForm> methods_and_forms() {
  std::vector<MethodAndForm> all;
  for (const NamedSolveMethod& named : kSolveMethods) {
    for (const Form form : {Form::kBlocks, Form::kExchange, Form::kCompressed}) {
      all.push_back({named, form});
    }
  }
  return all;
}

class EveryMethod : public testing::TestWithParam<MethodAndForm> {
 protected:
  static Case make_case(float largest_reflectance) {
    return Case(largest_reflectance, GetParam().form);
  }
  static SolveMethod method() { return GetParam().named.method; }
};

std::string name_of(const testing::TestParamInfo<MethodAndForm>& instance) {
  constexpr std::array<const char*, 3> kForms = {"Blocks", "Exchange", "Compressed"};
  std::string name(instance.param.named.name);
  std::erase(name, '-');
  return name + kForms[static_cast<std::size_t>(instance.param.form)];
}

INSTANTIATE_TEST_SUITE_P(Solvers, EveryMethod, testing::ValuesIn(methods_and_forms()), name_of);

TEST_P(EveryMethod, ReachesTheSolution) {
  for (const float rho : {0.0F, 0.5F, 0.9F}) {
    const Case c = make_case(rho);
    const auto solver = c.solver(method());
    const SolveResult result = solver->solve(c.system.initial_exitance, kTight);
    EXPECT_TRUE(result.converged) << rho << ": " << result.residual;
    EXPECT_FALSE(result.diverged);
    EXPECT_LE(c.error(solver->radiosity(), c.system.eliminate()), 1e-6) << rho;
  }
}

TEST_P(EveryMethod, BlackPatchesKeepTheirOwnLight) {
  const Case c = make_case(0.8F);
  const auto solver = c.solver(method());
  solver->solve(c.system.initial_exitance);
  for (std::size_t i = 0; i < kPatchCount; i += 5) {
    for (int k = 0; k < kChannelCount; ++k) {
      EXPECT_FLOAT_EQ(solver->radiosity()[i][k], c.system.initial_exitance[i][k]);
    }
  }
}

TEST_P(EveryMethod, ResidualIsMeasured) {
  const Case c = make_case(0.7F);
  const auto solver = c.solver(method());
  const SolveResult result =
      solver->solve(c.system.initial_exitance, {.max_sweeps = 2, .residual = 0});
  EXPECT_EQ(result.sweeps, 2);
  EXPECT_FALSE(result.converged);
  std::vector<Float3> rest(kPatchCount);
  FormFactorRows(c.system.exchange, c.system.area).gather(solver->radiosity(), rest);
  for (std::size_t i = 0; i < kPatchCount; ++i) {
    for (int k = 0; k < kChannelCount; ++k) {
      rest[i][k] = c.system.initial_exitance[i][k] + c.system.reflectance[i][k] * rest[i][k] -
                   solver->radiosity()[i][k];
    }
  }
  const double residual =
      area_norm(rest, c.system.area) / area_norm(c.system.initial_exitance, c.system.area);
  EXPECT_NEAR(result.residual, residual, 1e-3 * residual + 1e-7);
}

TEST_P(EveryMethod, BoundWithoutMeasuringHolds) {
  const Case c = make_case(0.8F);
  for (const int sweeps : {1, 3, 6}) {
    const auto measured = c.solver(method()), bounded = c.solver(method());
    const double truth =
        measured->solve(c.system.initial_exitance, {.max_sweeps = sweeps, .residual = 0}).residual;
    const double bound =
        bounded
            ->solve(c.system.initial_exitance,
                    {.max_sweeps = sweeps, .residual = 0, .measure_residual = false})
            .residual;
    EXPECT_EQ(copy(measured->radiosity()), copy(bounded->radiosity()));
    EXPECT_GE(bound * 1.001 + 2e-7, truth) << sweeps;
  }
}

TEST_P(EveryMethod, ErrorShrinksAtLeastByTheLargestReflectance) {
  // From nothing, whose error is 1, k sweeps leave rho^k or less.
  const float rho = 0.8F;
  const Case c = make_case(rho);
  const std::vector<Float3> truth = c.system.eliminate();
  const auto solver = c.solver(method());
  double bound = 1;
  for (int sweeps = 1; sweeps <= 8; ++sweeps) {
    bound *= rho;
    solver->reset();
    solver->solve(c.system.initial_exitance, {.max_sweeps = sweeps, .residual = 0});
    EXPECT_LE(c.error(solver->radiosity(), truth), bound) << sweeps;
  }
}

TEST_P(EveryMethod, WarmStartIsCheaperThanACold) {
  Case c = make_case(0.8F);
  const auto solver = c.solver(method());
  const SolveSettings settings = {.residual = 1e-5};
  const int cold = solver->solve(c.system.initial_exitance, settings).sweeps;
  EXPECT_EQ(solver->solve(c.system.initial_exitance, settings).sweeps, 1);
  for (std::size_t i = 0; i < kPatchCount; i += 7) c.system.initial_exitance[i][0] *= 1.01F;
  const int warm = solver->solve(c.system.initial_exitance, settings).sweeps;
  EXPECT_LT(warm, cold);
  EXPECT_LE(c.error(solver->radiosity(), c.system.eliminate()), 5e-5);
  solver->reset();
  EXPECT_EQ(solver->solve(c.system.initial_exitance, settings).sweeps, cold);
}

TEST_P(EveryMethod, TakesOtherReflectancesExactly) {
  Case c = make_case(0.6F);
  const auto solver = c.solver(method());
  solver->solve(c.system.initial_exitance, kTight);
  for (std::size_t i = 0; i < kPatchCount; ++i) {
    c.system.reflectance[i] = {i % 3 == 0 ? 0.0F : 0.85F, 0.4F, i % 5 == 0 ? 0.5F : 1e-6F};
  }
  solver->set_reflectance(c.system.reflectance);
  const SolveResult result = solver->solve(c.system.initial_exitance, kTight);
  EXPECT_TRUE(result.converged) << result.residual;
  EXPECT_LE(c.error(solver->radiosity(), c.system.eliminate()), 1e-6);
}

TEST_P(EveryMethod, ThreadsDoNotChangeABit) {
  const Case c = make_case(0.8F);
  Scheduler scheduler;
  const auto solve = [&] {
    const auto solver = c.solver(method());
    solver->solve(c.system.initial_exitance,
                  {.max_sweeps = 3, .residual = 0, .scheduler = scheduler});
    return copy(solver->radiosity());
  };
  const std::vector<Float3> one = test::with_threads(1, solve);
  for (const int count : {2, 5}) EXPECT_EQ(one, test::with_threads(count, solve)) << count;
  test::ThreadPool pool(3);
  scheduler = pool.scheduler();
  EXPECT_EQ(one, solve());
  EXPECT_GT(pool.loop_count(), 0);
}

TEST_P(EveryMethod, ASolveDoesNotAllocate) {
  const Case c = make_case(0.8F);
  const auto solver = c.solver(method());
  std::vector<Float3> radiosity(kPatchCount);
  solver->solve(c.system.initial_exitance);  // threads and their buffers are made once
  solver->reset();
  const int count = test::count_allocations([&] {
    solver->solve(c.system.initial_exitance, {}, radiosity);
    solver->set_reflectance(c.system.reflectance);
    solver->solve(c.system.initial_exitance, kTight);
  });
  EXPECT_EQ(count, 0);
}

TEST_P(EveryMethod, OneOffIsTheColdSolve) {
  const Case c = make_case(0.8F);
  std::vector<Float3> radiosity(kPatchCount);
  const SolveResult once = solve_radiosity(method(), *c.form_factors, c.system.problem(),
                                           c.system.initial_exitance, {}, radiosity, c.operator_);
  const auto solver = c.solver(method());
  EXPECT_EQ(solver->solve(c.system.initial_exitance).sweeps, once.sweeps);
  EXPECT_EQ(copy(solver->radiosity()), radiosity);
}

TEST_P(EveryMethod, AMonitorSeesWhatShorterSolvesEndWith) {
  const Case c = make_case(0.8F);
  const auto watched = c.solver(method());
  std::vector<std::vector<Float3>> seen;
  watched->set_monitor([&](std::span<const Float3> radiosity) {
    seen.push_back(copy(radiosity));
    return seen.size() < 3;
  });
  const SolveSettings settings = {.max_sweeps = 100, .residual = 0, .measure_residual = false};
  EXPECT_EQ(watched->solve(c.system.initial_exitance, settings).sweeps, 3);
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_EQ(copy(watched->radiosity()), seen.back());
  for (int sweeps = 1; sweeps <= 3; ++sweeps) {
    const auto solver = c.solver(method());
    solver->solve(c.system.initial_exitance, {.max_sweeps = sweeps, .residual = 0});
    EXPECT_EQ(copy(solver->radiosity()), seen[sweeps - 1]) << sweeps;
  }
  watched->set_monitor({});
  watched->solve(c.system.initial_exitance, settings);
  EXPECT_EQ(seen.size(), 3U);
}

TEST_P(EveryMethod, TimeBudgetEndsASolve) {
  const Case c = make_case(0.8F);
  const SolveResult result = c.solver(method())->solve(
      c.system.initial_exitance,
      {.max_sweeps = 1000000, .residual = 0, .time_budget_microseconds = 2000});
  EXPECT_LT(result.sweeps, 1000000);
  EXPECT_GE(result.microseconds, 2000);
}

TEST_P(EveryMethod, DarknessIsSolved) {
  const Case c = make_case(0.8F);
  const auto solver = c.solver(method());
  solver->solve(c.system.initial_exitance);
  const SolveResult result = solver->solve(std::vector<Float3>(kPatchCount, {0, 0, 0}));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(copy(solver->radiosity()), std::vector<Float3>(kPatchCount, {0, 0, 0}));
}

TEST_P(EveryMethod, RefusesWhatDoesNotFit) {
  Case c = make_case(0.5F);
  const auto solver = c.solver(method());
  const std::span<const Float3> m0 = c.system.initial_exitance;
  EXPECT_THROW(solver->solve(m0.first(5)), Error);
  EXPECT_THROW(solver->solve(m0, {.max_sweeps = 0}), Error);
  EXPECT_THROW(solver->solve(m0, {.residual = -1}), Error);
  EXPECT_THROW(solver->solve(m0, {.time_budget_microseconds = -1}), Error);
  EXPECT_THROW(solver->start_from(m0.first(5)), Error);
  EXPECT_THROW(solver->set_reflectance(m0.first(5)), Error);
  c.system.reflectance[3][1] = 1;
  EXPECT_THROW(solver->set_reflectance(c.system.reflectance), Error);
  const float good = c.system.initial_exitance[4][0];
  solver->solve(m0);
  const std::vector<Float3> before(solver->radiosity().begin(), solver->radiosity().end());
  for (const float bad : {std::numeric_limits<float>::infinity(), -good}) {
    c.system.initial_exitance[4][0] = bad;
    test::expect_error([&] { solver->solve(m0); }, "patch 4 is negative or not finite");
    EXPECT_TRUE(std::ranges::equal(solver->radiosity(), before));
  }
  c.system.area.pop_back();
  EXPECT_THROW(c.solver(method()), Error);
}

TEST_P(EveryMethod, DoesNotStartFromASolutionThatIsNotFinite) {
  const Case c = make_case(0.9F);
  const auto solver = c.solver(method()), fresh = c.solver(method());
  solver->solve(c.system.initial_exitance);
  const std::vector<Float3> bright(kPatchCount, Float3{3e38F, 3e38F, 3e38F});
  for (const bool measure : {true, false}) {
    const auto attempt = [&] { return solver->solve(bright, {.measure_residual = measure}); };
    if (method() == SolveMethod::kRefine) {  // undoes such a sweep
      EXPECT_TRUE(attempt().diverged);
      solver->reset();
    } else {
      test::expect_error(attempt, "the solution is not finite");
    }
  }
  EXPECT_TRUE(solver->solve(c.system.initial_exitance).converged);
  fresh->solve(c.system.initial_exitance);
  EXPECT_EQ(copy(solver->radiosity()), copy(fresh->radiosity()));
}

TEST(Refinement, AHandfulOfStepsFromThreePerCent) {
  const Case c(0.8F);  // its operator is 3 % too large
  const auto solver = c.solver(SolveMethod::kRefine);
  const SolveResult result = solver->solve(c.system.initial_exitance, kTight);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(result.sweeps, 8);
  EXPECT_GT(result.sweeps, 1);
}

TEST(Refinement, AnAbsurdOperatorIsReported) {
  const Case c(0.8F);
  for (const float scale : {-3.0F, 20.0F, std::numeric_limits<float>::quiet_NaN()}) {
    const auto absurd =
        std::make_shared<const SeriesOperator>(c.blocks, c.system.reflectance, scale);
    const auto solver = make_solver(SolveMethod::kRefine, c.blocks, c.system.problem(), absurd);
    const SolveResult result = solver->solve(c.system.initial_exitance);
    EXPECT_TRUE(result.diverged) << scale;
    EXPECT_FALSE(result.converged);
    EXPECT_LE(result.residual, 1.001);
    for (const Float3& b : solver->radiosity()) EXPECT_TRUE(std::isfinite(b[0]));
  }
}

TEST(Solvers, MissingOrOtherOperatorsAreRefused) {
  const Case c(0.5F);
  EXPECT_THROW(make_solver(SolveMethod::kRefine, c.blocks, c.system.problem()), Error);
  const System small(0.5F, 20);
  const FormFactorBlocks small_blocks(small.exchange, small.area);
  EXPECT_THROW(make_solver(SolveMethod::kRefine, small_blocks, small.problem(), c.operator_),
               Error);
}

TEST(Solvers, FormsThatAMethodCannotUseAreRefused) {
  const Case c(0.5F, Form::kExchange);
  const FormFactorRows gatherer(c.system.exchange, c.system.area);
  for (const SolveMethod method : {SolveMethod::kGaussSeidel, SolveMethod::kSymmetricGaussSeidel}) {
    EXPECT_THROW(make_solver(method, gatherer, c.system.problem()), Error);
  }
  EXPECT_NO_THROW(make_solver(SolveMethod::kConjugateGradient, gatherer, c.system.problem()));
}

TEST(Solvers, EveryMethodHasAFormOfItsOwn) {
  const Case c(0.5F);
  for (const NamedSolveMethod& named : kSolveMethods) {
    const auto form = make_form_factors(named.method, c.system.exchange, c.system.area);
    const auto solver = make_solver(named.method, *form, c.system.problem(), c.operator_);
    EXPECT_TRUE(solver->solve(c.system.initial_exitance, {.residual = 1e-5}).converged);
  }
}

}  // namespace
}  // namespace rebounce::test_solvers

#include "bench/report/method.h"

#include <algorithm>
#include <array>

#include "rebounce/error.h"
#include "transfer/base/argument_check.h"
#include "transfer/base/reflection.h"
#include "transfer/exchange/relaxation.h"

namespace rebounce::bench {
namespace {

constexpr std::array kIterations = {SolveMethod::kGathering, SolveMethod::kGaussSeidel,
                                    SolveMethod::kSymmetricGaussSeidel,
                                    SolveMethod::kConjugateGradient};

/// One product with the operator, and B from what arrives.
class ProductMethod final : public Method {
 public:
  ProductMethod(const TransferOperator& transfer, std::span<const Float3> reflectance)
      : transfer_(transfer),
        reflectance_(reflectance.begin(), reflectance.end()),
        radiosity_(reflectance.size()),
        workspace_(transfer.workspace_size()) {}

  using Method::run;
  int run(std::span<const Float3> initial_exitance, int /*sweeps*/, double /*residual*/) override {
    check_light_of_patches("the report: the initial exitance", initial_exitance);  // as solvers do
    transfer_.apply(initial_exitance, radiosity_, workspace_);
    add_reflected(initial_exitance, reflectance_, radiosity_, radiosity_);
    return 0;
  }
  void watch(std::span<const Float3> initial_exitance, int sweeps,
             const RadiositySolver::Monitor& monitor) override {
    run(initial_exitance, sweeps);
    monitor(radiosity_);
  }
  std::span<const Float3> radiosity() const override { return radiosity_; }
  bool iterates() const override { return false; }
  void reset() override {}
  void start_from(std::span<const Float3> /*radiosity*/) override {}
  void set_reflectance(std::span<const Float3> reflectance) override {
    std::ranges::copy(reflectance, reflectance_.begin());
  }

 private:
  const TransferOperator& transfer_;
  std::vector<Float3> reflectance_, radiosity_;
  std::vector<float> workspace_;
};

class IterativeMethod final : public Method {
 public:
  explicit IterativeMethod(std::unique_ptr<RadiositySolver> solver) : solver_(std::move(solver)) {}

  using Method::run;
  int run(std::span<const Float3> initial_exitance, int sweeps, double residual) override {
    const SolveSettings settings{
        .max_sweeps = sweeps, .residual = residual, .measure_residual = false};
    return solver_->solve(initial_exitance, settings).sweeps;
  }
  void watch(std::span<const Float3> initial_exitance, int sweeps,
             const RadiositySolver::Monitor& monitor) override {
    solver_->set_monitor(monitor);
    run(initial_exitance, sweeps);
    solver_->set_monitor({});
  }
  std::span<const Float3> radiosity() const override { return solver_->radiosity(); }
  bool iterates() const override { return true; }
  void reset() override { solver_->reset(); }
  void start_from(std::span<const Float3> radiosity) override { solver_->start_from(radiosity); }
  void set_reflectance(std::span<const Float3> reflectance) override {
    solver_->set_reflectance(reflectance);
  }

 private:
  std::unique_ptr<RadiositySolver> solver_;
};

std::string name_of(SolveMethod method) {
  return std::string(std::ranges::find(kSolveMethods, method, &NamedSolveMethod::method)->name);
}

/// What the products are called, by their kind.
std::string product_name(const TransferOperator& transfer) {
  if (transfer.kind() == OperatorKind::kDense) return kDenseInverse;
  if (transfer.kind() == OperatorKind::kHierarchical) return "inverse";
  return "low rank";
}

void add_products(const Contenders& contenders, std::vector<Contestant>& list) {
  for (const StoredOperator& stored : contenders.operators) {
    list.push_back({.name = product_name(*stored.transfer),
                    .transfer = stored.name,
                    .bytes = stored.transfer->bytes(),
                    .bytes_read = stored.transfer->bytes_per_apply(),
                    .product = true});
  }
}

/// How often a method reads all of F.
struct Reads {
  std::size_t sweep = 1, cold_start = 0, warm_start = 0;
};

Reads reads_of(SolveMethod method, const FormFactorOperator& form_factors) {
  if (method == SolveMethod::kGathering) return {};
  if (method == SolveMethod::kConjugateGradient) return {.cold_start = 1, .warm_start = 2};
  const auto relaxation = dynamic_cast<const SweepableFormFactors&>(form_factors).make_relaxation();
  const auto forward = static_cast<std::size_t>(relaxation->reads_per_sweep(SweepOrder::kForward));
  if (method == SolveMethod::kGaussSeidel) return {.sweep = forward};
  const auto both = static_cast<std::size_t>(relaxation->reads_per_sweep(SweepOrder::kSymmetric));
  // The first sweep finds what later ones keep from the sweep before.
  return {.sweep = both, .cold_start = forward - both, .warm_start = forward - both};
}

Contestant iteration(SolveMethod method, const Form& form) {
  const FormFactorOperator& form_factors = *form.form_factors;
  const std::string name = form.name == kLinks && method == SolveMethod::kGathering
                               ? "hierarchical radiosity"
                               : name_of(method);
  const bool gathers =
      method == SolveMethod::kGathering || method == SolveMethod::kConjugateGradient;
  const std::size_t read = gathers ? form_factors.bytes_per_gather() : form_factors.bytes();
  const Reads reads = reads_of(method, form_factors);
  return {.name = name,
          .form = form.name,
          .bytes = form_factors.bytes(),
          .bytes_read = reads.sweep * read,
          .bytes_of_cold_start = reads.cold_start * read,
          .bytes_of_warm_start = reads.warm_start * read,
          .method = method};
}

/// Whether `form` is one that `method` may be fastest on. What only gathers has the smaller form of
/// each compressed F, whose bases are shared; what sweeps cannot use it.
bool suits(SolveMethod method, const Form& form) {
  if (form.name == kLinks) return method == SolveMethod::kGathering;
  if (form.name == kExactRows) return method == SolveMethod::kGaussSeidel;
  if (form.name == kExactHalf) return method != SolveMethod::kGaussSeidel;
  const bool sweeps =
      method == SolveMethod::kGaussSeidel || method == SolveMethod::kSymmetricGaussSeidel;
  return sweeps == can_sweep(form);
}

void add_iterations(const Contenders& contenders, std::vector<Contestant>& list) {
  for (const Form& form : contenders.forms) {
    for (const SolveMethod method : kIterations) {
      if (suits(method, form)) list.push_back(iteration(method, form));
    }
  }
}

/// What needs both: coarse operators, on exact form factors and on all finer compressed ones.
void add_refinements(const Contenders& contenders, const ReportSettings& settings,
                     std::vector<Contestant>& list) {
  for (const double refined : settings.refined_tolerances) {
    const std::string name = hierarchical_name(refined);
    std::vector<std::string> forms = {kExactHalf};
    for (const double tolerance : settings.tolerances) {
      if (tolerance < refined) forms.push_back(shared_name(tolerance));
    }
    const TransferOperator& transfer = *contenders.transfer(name);
    for (const std::string& form : forms) {
      const FormFactorOperator& form_factors = *contenders.form(form);
      list.push_back({.name = name_of(SolveMethod::kRefine),
                      .transfer = name,
                      .form = form,
                      .bytes = transfer.bytes() + form_factors.bytes(),
                      .bytes_read = transfer.bytes_per_apply() + form_factors.bytes_per_gather(),
                      .bytes_of_warm_start = form_factors.bytes_per_gather(),
                      .method = SolveMethod::kRefine});
    }
  }
}

}  // namespace

std::unique_ptr<Method> Contestant::make(const Contenders& contenders) const {
  const PatchTable& patches = contenders.data->patches;
  if (product) {
    return std::make_unique<ProductMethod>(*contenders.transfer(transfer), patches.reflectance);
  }
  const auto stored = transfer.empty() ? nullptr : contenders.transfer(transfer);
  return std::make_unique<IterativeMethod>(
      make_solver(method, *contenders.form(form), {patches.area, patches.reflectance}, stored));
}

std::vector<Contestant> list_contestants(const Contenders& contenders,
                                         const ReportSettings& settings) {
  std::vector<Contestant> list;
  add_products(contenders, list);
  add_refinements(contenders, settings, list);
  add_iterations(contenders, list);
  return list;
}

}  // namespace rebounce::bench

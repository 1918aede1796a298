#include "bench/report/method.h"

#include <algorithm>
#include <array>

#include "rebounce/error.h"
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
  void run(std::span<const Float3> initial_exitance, int /*sweeps*/, double /*residual*/) override {
    transfer_.apply(initial_exitance, radiosity_, workspace_);
    add_reflected(initial_exitance, reflectance_, radiosity_, radiosity_);
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
  void run(std::span<const Float3> initial_exitance, int sweeps, double residual) override {
    solver_->solve(initial_exitance,
                   {.max_sweeps = sweeps, .residual = residual, .measure_residual = false});
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

/// What one sweep of a method reads of F, bytes; what it reads twice counts twice.
std::size_t bytes_per_sweep(SolveMethod method, const Form& form) {
  const FormFactorOperator& form_factors = *form.form_factors;
  const bool symmetric = method == SolveMethod::kSymmetricGaussSeidel;
  if (method != SolveMethod::kGaussSeidel && !symmetric) return form_factors.bytes_per_gather();
  const auto relaxation = dynamic_cast<const SweepableFormFactors&>(form_factors).make_relaxation();
  return form_factors.bytes() *
         relaxation->reads_per_sweep(symmetric ? SweepOrder::kSymmetric : SweepOrder::kForward);
}

Contestant iteration(SolveMethod method, const Form& form) {
  const std::string name = form.name == kLinks && method == SolveMethod::kGathering
                               ? "hierarchical radiosity"
                               : name_of(method);
  return {.name = name,
          .form = form.name,
          .bytes = form.form_factors->bytes(),
          .bytes_read = bytes_per_sweep(method, form),
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

int Contestant::sweeps_of_cuts() const {
  if (product) return 0;
  if (method == SolveMethod::kSymmetricGaussSeidel) return 2;  // there and back
  return method == SolveMethod::kGaussSeidel || method == SolveMethod::kGathering ? 1 : 0;
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

#include "bench/report/method.h"

#include <algorithm>
#include <array>

#include "rebounce/error.h"
#include "transfer/base/reflection.h"

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

const StoredOperator& find_operator(const Contenders& contenders, const std::string& name) {
  const auto found = std::ranges::find(contenders.operators, name, &StoredOperator::name);
  if (found == contenders.operators.end()) throw Error("the report has no operator named " + name);
  return *found;
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
                    .product = true});
  }
}

Contestant iteration(SolveMethod method, const Form& form) {
  const std::string name = form.name == kLinks && method == SolveMethod::kGathering
                               ? "hierarchical radiosity"
                               : name_of(method);
  return {.name = name, .form = form.name, .bytes = form.form_factors->bytes(), .method = method};
}

/// Whether `form` is one that `method` may be fastest on.
bool suits(SolveMethod method, const Form& form) {
  if (form.name == kLinks) return method == SolveMethod::kGathering;
  if (form.name == kExactRows) return method == SolveMethod::kGaussSeidel;
  if (form.name == kExactHalf) return method != SolveMethod::kGaussSeidel;
  return true;
}

void add_iterations(const Contenders& contenders, std::vector<Contestant>& list) {
  for (const Form& form : contenders.forms) {
    for (const SolveMethod method : kIterations) {
      if (suits(method, form)) list.push_back(iteration(method, form));
    }
  }
}

/// What needs both: on exact form factors and on the most exact compressed ones.
void add_refinements(const Contenders& contenders, const ReportSettings& settings,
                     std::vector<Contestant>& list) {
  const StoredOperator& stored = contenders.operators.front();
  for (const std::string& form :
       {std::string(kExactHalf), compressed_name(settings.form_factor_tolerances.front())}) {
    list.push_back({.name = name_of(SolveMethod::kRefine),
                    .transfer = stored.name,
                    .form = form,
                    .bytes = stored.transfer->bytes() + contenders.form(form)->bytes(),
                    .method = SolveMethod::kRefine});
  }
}

}  // namespace

std::unique_ptr<Method> Contestant::make(const Contenders& contenders) const {
  const PatchTable& patches = contenders.data->patches;
  if (product) {
    return std::make_unique<ProductMethod>(*find_operator(contenders, transfer).transfer,
                                           patches.reflectance);
  }
  const auto stored = transfer.empty() ? nullptr : find_operator(contenders, transfer).transfer;
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

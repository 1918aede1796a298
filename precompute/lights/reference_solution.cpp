#include "precompute/lights/reference_solution.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "precompute/base/arithmetic.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

using Double3 = ReferenceSolver::Double3;
using Form = ReferenceSolver::Form;

constexpr int kMaxSteps = 10000;

// Above this residual, in parts of the reflected light, links gather in single precision, which is
// twice as fast; the rounding error is a hundredth of the residual. For some lights it is more,
// because what links carry too much and too little cancels: these are solved in double precision
// after kSingleRounds.
constexpr double kSinglePrecisionSuffices = 1e-5;
constexpr int kSingleRounds = 2;

/// A column is a patch. It holds all channels of the first light, then of the next.
template <int kRows>
using Field = Eigen::Array<double, kRows, Eigen::Dynamic>;

/// F times `in`.
template <int kRows>
Field<kRows> times(const FormFactorRows& rows, const Field<kRows>& in) {
  Field<kRows> out(kRows, in.cols());
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index i = 0; i < in.cols(); ++i) {
    const auto columns = rows.columns(i);
    const auto factors = rows.form_factors(i);
    Eigen::Array<double, kRows, 1> sum = Eigen::Array<double, kRows, 1>::Zero();
    for (std::size_t k = 0; k < columns.size(); ++k) {
      sum += static_cast<double>(factors[k]) * in.col(columns[k]);
    }
    out.col(i) = sum;
  }
  return out;
}

/// Gathers along links in the arithmetic of `Scalar`, with memory that is used again.
template <typename Scalar, int kRows>
class LinkGatherer {
 public:
  void gather(const LinkedFormFactors& links, const Field<kRows>& in, Field<kRows>& out) {
    lights_.in.resize(in.cols());
    Map(lights_.in.front().data(), kRows, in.cols()) = in.template cast<Scalar>();
    links.gather(lights_);
    out = Map(lights_.out.front().data(), kRows, in.cols()).template cast<double>();
  }

 private:
  using Columns = std::array<Scalar, kRows>;
  using Map = Eigen::Map<Eigen::Array<Scalar, kRows, Eigen::Dynamic>>;

  GatheredLights<Columns> lights_;
};

/// One light after the other, in single precision.
template <int kRows>
Field<kRows> times(const CompressedFormFactors& compressed, const Field<kRows>& in) {
  Field<kRows> out(kRows, in.cols());
  std::vector<Float3> from(in.cols()), to(in.cols());
  std::vector<float> workspace(compressed.workspace_size());
  for (int begin = 0; begin < kRows; begin += kChannelCount) {
    for (Eigen::Index i = 0; i < in.cols(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) from[i][c] = static_cast<float>(in(begin + c, i));
    }
    compressed.gather(from, to, workspace);
    for (Eigen::Index i = 0; i < in.cols(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) out(begin + c, i) = to[i][c];
    }
  }
  return out;
}

/// The system and how it is solved.
struct System {
  const Form& form;
  const PatchTable& patches;
};

/// The residual of (I - rho F) B = M0. A light is solved if one of the two is small enough.
struct Residual {
  double of_initial_exitance;  ///< relative to M0
  double of_reflected_light;   ///< relative to rho H
};

/// kLights lights on one scene, solved together.
template <int kLights>
class ConjugateGradients {
 public:
  using Lights = std::span<const std::vector<Float3>>;
  static constexpr int kRows = kLights * kChannelCount;
  using Field = rebounce::Field<kRows>;

  struct Solution {
    Field radiosity, indirect_irradiance;
  };

  /// `lights` has at most kLights entries.
  ConjugateGradients(const System& system, Lights lights)
      : form_(system.form),
        area_(Eigen::Map<const Eigen::VectorXf>(system.patches.area.data(),
                                                std::ssize(system.patches.area))
                  .cast<double>()),
        root_(kRows, area_.size()),
        m0_(Field::Zero(kRows, area_.size())) {
    const PatchTable& patches = system.patches;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      for (int k = 0; k < kRows; ++k) {
        const int light = k / kChannelCount, channel = k % kChannelCount;
        root_(k, i) = std::sqrt(static_cast<double>(patches.reflectance[i][channel]));
        if (light < std::ssize(lights)) m0_(k, i) = lights[light][i][channel];
      }
    }
  }

  Solution solve(const Residual& residual) {
    const Totals of_initial =
        residual.of_initial_exitance * residual.of_initial_exitance * per_light(product(m0_, m0_));
    Field z = Field::Zero(kRows, m0_.cols());
    const bool coarse = residual.of_reflected_light >= kSinglePrecisionSuffices;
    for (int steps = 0, round = 0; steps < kMaxSteps; ++round) {
      const Arithmetic arithmetic =
          coarse && round < kSingleRounds ? Arithmetic::kSingle : Arithmetic::kDouble;
      Field b = m0_ + root_ * z, h;
      gather(b, arithmetic, h);
      Field r = root_ * h;
      const Totals allowed = of_initial.max(residual.of_reflected_light *
                                            residual.of_reflected_light * exitance_squares(r));
      r -= z;  // R r is the residual of B
      if ((exitance_squares(r) <= allowed).all()) return {std::move(b), std::move(h)};
      b.resize(kRows, 0);  // so as not to be held meanwhile
      h.resize(kRows, 0);
      descend(std::move(r), allowed, arithmetic, z, steps);
    }
    throw Error("the reference solution did not converge in " + std::to_string(kMaxSteps) +
                " steps; a reflectance is too close to 1");
  }

 private:
  using Products = Eigen::Array<double, kRows, 1>;  ///< by light and channel
  using Totals = Eigen::Array<double, kLights, 1>;  ///< by light

  /// Improves `z`, with residual `r`, until the residual is small enough by the recursion of
  /// conjugate gradients (M. R. Hestenes and E. Stiefel, 1952).
  void descend(Field r, const Totals& allowed, Arithmetic arithmetic, Field& z, int& steps) {
    Field p = r, q;
    Products rr = product(r, r);
    do {
      gather(root_ * p, arithmetic, q);
      q = p - root_ * q;
      const Products alpha = quotient(rr, product(p, q));
      z += p.colwise() * alpha;
      r -= q.colwise() * alpha;
      const Products before = std::exchange(rr, product(r, r));
      p = r + p.colwise() * quotient(rr, before);
    } while (++steps < kMaxSteps && !(exitance_squares(r) <= allowed).all());
  }

  /// F times `in`; links gather in single precision where that is enough.
  void gather(const Field& in, Arithmetic arithmetic, Field& out) {
    using Links = std::shared_ptr<const LinkedFormFactors>;
    const auto along = [&](const auto& form) {
      if constexpr (!std::is_same_v<std::decay_t<decltype(form)>, Links>) {
        out = times<kRows>(form, in);
      } else if (arithmetic == Arithmetic::kSingle) {
        single_.gather(*form, in, out);
      } else {
        single_ = {};  // never again after double precision
        double_.gather(*form, in, out);
      }
    };
    std::visit(along, form_);
  }

  /// The squared area norms of R v.
  Totals exitance_squares(const Field& v) const {
    const Field scaled = root_ * v;
    return per_light(product(scaled, scaled));
  }

  /// The area-weighted inner products.
  Products product(const Field& a, const Field& b) const {
    return ((a * b).rowwise() * area_).rowwise().sum();
  }

  static Totals per_light(const Products& products) {
    return products.reshaped(kChannelCount, kLights).colwise().sum().transpose();
  }

  /// a / b; 0 where b is 0: channels that are dark or solved.
  static Products quotient(const Products& a, const Products& b) {
    return (b > 0).select(a / b, 0);
  }

  const Form& form_;
  Eigen::Array<double, 1, Eigen::Dynamic> area_;
  Field root_, m0_;
  LinkGatherer<float, kRows> single_;
  LinkGatherer<double, kRows> double_;
};

Form best_form(const TransferData& data) {
  if (!data.exchange.empty()) return FormFactorRows(data.exchange, data.patches.area);
  if (!data.links.empty()) {
    return std::make_shared<const LinkedFormFactors>(data.links, data.patches.area,
                                                     data.patches.centroid);
  }
  if (!data.compressed_form_factors) {
    throw Error(
        "there are no form factors to compare with; make the transfer file again with precompute "
        "--store-form-factors or --compress-form-factors");
  }
  return CompressedFormFactors(data.compressed_form_factors);
}

enum class Quantity { kRadiosity, kIndirectIrradiance };

/// Appends the solutions [n] of at most kLights lights.
template <int kLights>
void solve_together(const System& system, std::span<const std::vector<Float3>> lights,
                    const Residual& residual, Quantity quantity,
                    std::vector<std::vector<Double3>>& solutions) {
  ConjugateGradients<kLights> solver(system, lights);
  const auto solved = solver.solve(residual);
  const auto& field =
      quantity == Quantity::kRadiosity ? solved.radiosity : solved.indirect_irradiance;
  for (std::size_t light = 0; light < lights.size(); ++light) {
    std::vector<Double3>& solution = solutions.emplace_back(system.patches.size());
    for (std::size_t i = 0; i < solution.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) solution[i][c] = field(light * kChannelCount + c, i);
    }
  }
}

std::vector<std::vector<Double3>> solve(const System& system,
                                        std::span<const std::vector<Float3>> lights,
                                        Residual residual, Quantity quantity) {
  if (std::holds_alternative<CompressedFormFactors>(system.form)) {
    residual.of_initial_exitance =
        std::max(residual.of_initial_exitance, ReferenceSolver::kSinglePrecisionResidual);
  }
  std::vector<std::vector<Double3>> solutions;
  while (solutions.size() < lights.size()) {
    const auto left = lights.subspan(solutions.size());
    if (left.size() == 1) {
      solve_together<1>(system, left, residual, quantity, solutions);
    } else {
      solve_together<ReferenceSolver::kBatchLights>(
          system, left.first(std::min<std::size_t>(ReferenceSolver::kBatchLights, left.size())),
          residual, quantity, solutions);
    }
  }
  return solutions;
}

}  // namespace

ReferenceSolver::ReferenceSolver(const ExchangeMatrix& exchange, const PatchTable& patches)
    : patches_(patches), form_(FormFactorRows(exchange, patches.area)) {}

ReferenceSolver::ReferenceSolver(const FormFactorLinks& links, const PatchTable& patches)
    : ReferenceSolver(
          std::make_shared<const LinkedFormFactors>(links, patches.area, patches.centroid),
          patches) {}

ReferenceSolver::ReferenceSolver(std::shared_ptr<const LinkedFormFactors> links,
                                 const PatchTable& patches)
    : patches_(patches), form_(std::move(links)) {}

ReferenceSolver::ReferenceSolver(const TransferData& data)
    : patches_(data.patches), form_(best_form(data)) {}

std::vector<Double3> ReferenceSolver::radiosity(std::span<const Float3> initial_exitance,
                                                double residual) const {
  const std::vector<Float3> light(initial_exitance.begin(), initial_exitance.end());
  return radiosities({&light, 1}, residual).front();
}

std::vector<std::vector<Double3>> ReferenceSolver::radiosities(
    std::span<const std::vector<Float3>> initial_exitances, double residual) const {
  return solve({form_, patches_}, initial_exitances,
               {.of_initial_exitance = residual, .of_reflected_light = 0}, Quantity::kRadiosity);
}

std::vector<Float3> ReferenceSolver::indirect_irradiance(std::span<const Float3> initial_exitance,
                                                         double residual) const {
  const std::vector<Float3> light(initial_exitance.begin(), initial_exitance.end());
  return indirect_irradiances({&light, 1}, residual).front();
}

std::vector<std::vector<Float3>> ReferenceSolver::indirect_irradiances(
    std::span<const std::vector<Float3>> initial_exitances, double residual,
    double of_reflected_light) const {
  const auto solutions =
      solve({form_, patches_}, initial_exitances,
            {.of_initial_exitance = residual, .of_reflected_light = of_reflected_light},
            Quantity::kIndirectIrradiance);
  std::vector<std::vector<Float3>> result;
  for (const std::vector<Double3>& h : solutions) result.push_back(rounded(h));
  return result;
}

std::vector<Float3> rounded(std::span<const Double3> solution) {
  std::vector<Float3> result(solution.size());
  std::ranges::transform(solution, result.begin(), [](const Double3& v) {
    return Float3{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
  });
  return result;
}

}  // namespace rebounce

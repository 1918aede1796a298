#include "precompute/outputs/local_max_entropy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace rebounce {
namespace {

constexpr int kMostSteps = 20, kMostHalvings = 10;
constexpr double kSmallStep = 1e-6;

/// log Z + ridge/2 |mu|² and its derivatives, for Newton's method.
class Potential {
 public:
  Potential(std::span<const double> prior, std::span<const glm::dvec2> place, double ridge)
      : prior_(prior), place_(place), ridge_(ridge), weight_(prior.size()) {}

  double at(const glm::dvec2& mu) {
    // Dividing by the largest exponential prevents overflow.
    double largest = -std::numeric_limits<double>::infinity();
    for (const glm::dvec2& x : place_) largest = std::max(largest, -glm::dot(mu, x));
    double z = 0;
    mean_ = glm::dvec2(0);
    glm::dmat2 square(0);
    for (std::size_t k = 0; k < place_.size(); ++k) {
      weight_[k] = prior_[k] * std::exp(-glm::dot(mu, place_[k]) - largest);
      z += weight_[k];
      mean_ += weight_[k] * place_[k];
      square += weight_[k] * glm::outerProduct(place_[k], place_[k]);
    }
    for (double& w : weight_) w /= z;
    mean_ /= z;
    curvature_ = square / z - glm::outerProduct(mean_, mean_) + glm::dmat2(ridge_);
    gradient_ = ridge_ * mu - mean_;
    return std::log(z) + largest + 0.5 * ridge_ * glm::dot(mu, mu);
  }

  glm::dvec2 newton_step() const { return -(glm::inverse(curvature_) * gradient_); }
  std::vector<double>& weights() { return weight_; }

 private:
  std::span<const double> prior_;
  std::span<const glm::dvec2> place_;
  double ridge_;
  std::vector<double> weight_;
  glm::dvec2 mean_{0}, gradient_{0};
  glm::dmat2 curvature_{1};
};

}  // namespace

std::vector<double> max_entropy_weights(std::span<const double> prior,
                                        std::span<const glm::dvec2> place, double ridge) {
  Potential potential(prior, place, ridge);
  glm::dvec2 mu(0);
  double value = potential.at(mu);
  for (int k = 0; k < kMostSteps; ++k) {
    glm::dvec2 step = potential.newton_step();
    if (glm::length(step) < kSmallStep) break;
    double next = potential.at(mu + step);
    for (int halving = 0; next > value && halving < kMostHalvings; ++halving) {
      step *= 0.5;
      next = potential.at(mu + step);
    }
    if (next > value) break;
    mu += step;
    value = next;
  }
  potential.at(mu);
  return std::move(potential.weights());
}

}  // namespace rebounce

#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace rebounce {

/// Shifts the `prior` weights of values at `place`, relative to the origin, so that the weighted
/// mean place is nearly the origin: a linear field is then interpolated without the error of a
/// plain mean. Among all such weights these are nearest to `prior` in relative entropy, and hence
/// positive: w_k = prior_k exp(-mu . place_k) / Z. If the origin lies outside the places (at an
/// edge of the surface), the weights lean to the nearest.
///
/// `ridge` > 0 controls how exactly: mu minimises log Z + ridge/2 |mu|², and the mean place that
/// remains is ridge mu. Source: M. Arroyo and M. Ortiz, "Local maximum-entropy approximation
/// schemes", International Journal for Numerical Methods in Engineering 65 (2006); the ridge
/// relaxes their constraint.
///
/// Both spans have the same size, at least one; `prior` > 0, `place` is scaled to a size of about
/// one. Returns weights whose sum is 1.
std::vector<double> max_entropy_weights(std::span<const double> prior,
                                        std::span<const glm::dvec2> place, double ridge);

}  // namespace rebounce

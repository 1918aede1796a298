#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace rebounce {

/// Shifts the `prior` weights of values at `place`, seen from the origin, so that their mean place
/// is nearly the origin: a field that is linear in the place is then met without the error of a
/// plain mean. Of all weights that do so the ones nearest to `prior` in relative entropy, hence
/// positive: w_k = prior_k exp(-mu . place_k) / Z. Where the origin is outside of the places (at an
/// edge of the surface) they lean to the nearest.
///
/// `ridge` > 0 says how firmly: mu minimises log Z + ridge/2 |mu|²; the mean place that is left is
/// ridge mu. Source: Arroyo and Ortiz, "Local maximum-entropy approximation schemes", International
/// Journal for Numerical Methods in Engineering 65 (2006), their constraint relaxed by the ridge.
///
/// Both spans have the same size, at least one; `prior` > 0, `place` about the size of one. Returns
/// weights whose sum is 1.
std::vector<double> max_entropy_weights(std::span<const double> prior,
                                        std::span<const glm::dvec2> place, double ridge);

}  // namespace rebounce

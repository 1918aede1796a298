#pragma once

#include <string>
#include <vector>

#include "precompute/import/scene.h"

namespace rebounce::bench {

/// Two surfaces, of materials 0 and 1, whose form factor is known in closed form.
struct KnownFormFactor {
  std::string name;
  Scene scene;
  double factor = 0;  ///< from material 0 to material 1
};

/// The rows of a table of view factors (tests/reference/view_factors.tsv) that are of two polygons.
/// Throws Error if there is no such file.
std::vector<KnownFormFactor> tabled_form_factors(const std::string& path);

/// Squares with something between them that hides a part, by mirror symmetry or by what crosses an
/// opening.
std::vector<KnownFormFactor> hidden_form_factors();

}  // namespace rebounce::bench

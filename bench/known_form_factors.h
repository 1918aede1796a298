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
  /// What the scene itself differs by (discs with corners), as a part of the factor: by the contour
  /// integral, which tests of the kernel compare with the table.
  double model_error = 0;
};

/// Every row of a table of view factors (tests/reference/view_factors.tsv) but the infinitely long
/// ones, which tests of the kernel have. Throws std::runtime_error if there is no such file.
std::vector<KnownFormFactor> tabled_form_factors(const std::string& path);

/// Squares with something between them that hides a part, by mirror symmetry or by what crosses an
/// opening.
std::vector<KnownFormFactor> hidden_form_factors();

/// View factor from the rectangle [x0, x1] x [y0, y1] to another one, parallel to it and facing it
/// at distance `z`, of edges [u0, u1] x [v0, v1]. J. R. Howell's catalogue, C-13; J. R. Ehlert and
/// T. F. Smith, "View factors for perpendicular and parallel rectangular plates", 1993.
struct Rectangle {
  double x0, x1, y0, y1;
};
double parallel_rectangles(const Rectangle& from, const Rectangle& to, double z);

}  // namespace rebounce::bench

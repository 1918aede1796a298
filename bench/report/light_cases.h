#pragma once

#include <map>
#include <string>
#include <vector>

#include "bench/report/contenders.h"

namespace rebounce::bench {

/// A change of the light under one lamp, or of the surfaces.
struct LightCase {
  std::string change;               ///< "from zero", "moved 1 %", "switched", "repainted"
  bool cold = false;                ///< whether there is no light before
  std::vector<Float3> after;        ///< M0 [n] in lx
  std::vector<Float3> reflectance;  ///< [n] that holds after the change
  std::vector<Float3> truth;        ///< B [n] in lx: in double precision, to 1e-10
};

/// The change after which surfaces of the commonest material reflect half of what they did.
inline constexpr const char* kRepainted = "repainted";

/// The changes of light_changes.h for each of settings.lamp_count lamps, the switched one a second
/// time from a cold start, which is often the better one then, and a repainted scene under each.
/// All lamps of a change follow each other, and what a change begins with is what the first one,
/// "from zero", ends with. Throws Error if the scene cannot be lit so, Cancelled if asked to stop.
std::vector<LightCase> make_light_cases(const Contenders& contenders,
                                        const ReportSettings& settings,
                                        const ReportProgress& progress);

/// What one form of F makes of the cases: the solution B [n] in lx after each, by conjugate
/// gradients. That of exact form factors is the truth. Throws Cancelled if asked to stop.
std::vector<std::vector<Float3>> solve_on(const Form& form, const Contenders& contenders,
                                          const std::vector<LightCase>& cases,
                                          const ReportProgress& progress);

}  // namespace rebounce::bench

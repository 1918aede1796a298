#pragma once

#include <string>

#include "bench/asked_table.h"

namespace rebounce::bench {

/// Measures form factors against closed forms: those of `view_factors`, a table as
/// tests/reference/view_factors.tsv, and partly hidden ones; the row sums of closed rooms; and
/// spheres. Throws std::runtime_error if there is no such table.
void measure_closed_forms(const std::string& view_factors, AskedTable& report);

}  // namespace rebounce::bench

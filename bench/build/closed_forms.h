#pragma once

#include <string>

#include "bench/support/table.h"

namespace rebounce::bench {

/// Measures form factors against closed forms, at the default quality and the high one: the errors,
/// beside what is asked (below 1: met). `view_factors` is a table as
/// tests/reference/view_factors.tsv. Throws Error if there is no such file.
Table measure_closed_forms(const std::string& view_factors);

}  // namespace rebounce::bench

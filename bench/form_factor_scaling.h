#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "bench/asked_table.h"

namespace rebounce::bench {

/// Measures what finding links of `epsilon` takes, from patches to form factors, of the
/// scene at `path` with about as many patches as each of `patch_counts`, ascending; the exponent
/// with which processor seconds grow is over the whole range. Throws Error if the scene cannot be
/// used.
void measure_growth(const std::string& path, std::span<const std::size_t> patch_counts,
                    double epsilon, AskedTable& report);

}  // namespace rebounce::bench

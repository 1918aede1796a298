#pragma once

#include <span>

#include "bench/support/form_factor_forms.h"
#include "bench/support/light_changes.h"
#include "bench/support/table.h"

namespace rebounce::bench {

Table make_solve_table();

/// Adds a row for the product with the operator of `data`, and one for each form of F, method and
/// change of the light: the fewest sweeps to errors of 1, 0.1 and 0.01 %, and their times.
void measure_solves(const TransferData& data, std::span<const Form> forms,
                    std::span<const LightChange> changes, int rounds, Table& table);

}  // namespace rebounce::bench

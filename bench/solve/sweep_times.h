#pragma once

#include <span>

#include "bench/support/form_factor_forms.h"
#include "bench/support/table.h"

namespace rebounce::bench {

Table make_sweep_table();

/// Adds a row for each form and kind of sweep: its time under `light` [n] in lx beside the
/// bandwidth with which the same run merely reads as many bytes.
void measure_sweeps(const TransferData& data, std::span<const Form> forms,
                    std::span<const Float3> light, int rounds, Table& table);

}  // namespace rebounce::bench

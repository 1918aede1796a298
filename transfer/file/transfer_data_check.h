#pragma once

#include <string>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Checks everything but the values of the operator: sizes agree, indices are in range, numbers are
/// finite and in the ranges that scene_data.h states. Throws Error that names `file` and the
/// first wrong tensor.
void check_transfer_data(const TransferData& data, const std::string& file);

}  // namespace rebounce

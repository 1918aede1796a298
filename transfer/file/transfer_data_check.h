#pragma once

#include <string>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Checks all but the operator's values: that sizes agree, indices are in range, numbers finite and
/// what transfer_data.h says of them. Throws Error, naming `file` and the tensor, at the first that
/// is not.
void check_transfer_data(const TransferData& data, const std::string& file);

}  // namespace rebounce

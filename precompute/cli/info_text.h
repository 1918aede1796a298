#pragma once

#include <cstdint>
#include <string>

#include "precompute/cli/frame_cost.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::cli {

/// What is in a transfer file of `file_bytes`, for people: lines of text, the last with its end.
/// `times` are those of a frame on this machine. Any text that the file has for its settings and
/// its report is taken; what it does not say is left out.
std::string info_text(const TransferData& data, std::uint64_t file_bytes, const FrameTimes& times);

}  // namespace rebounce::cli

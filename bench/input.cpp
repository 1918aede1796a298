#include "input.h"

#include <filesystem>

#include "rebounce/transfer/transfer_file.h"

namespace rebounce::bench {

TransferData load_or_build(const std::string& input, const BuildSettings& settings) {
  if (std::filesystem::path(input).extension() == ".safetensors") {
    return load_transfer_file(input);
  }
  BuildReport report;
  return build_transfer_data(input, settings, report);
}

std::string scene_name(const TransferData& data) {
  return std::filesystem::path(data.record.scene_name).stem().string();
}

}  // namespace rebounce::bench

#include "bench/input.h"

#include "precompute/patches/winding.h"
#include "transfer/file/transfer_file.h"

namespace rebounce::bench {

TransferData load_or_build(const std::string& input, const BuildSettings& settings) {
  if (std::filesystem::path(input).extension() == ".safetensors") {
    return load_transfer_file(input);
  }
  BuildReport report;
  return build_transfer_data(input, settings, report);
}

PatchModel model_of_scene(const std::string& path, std::size_t patch_count) {
  return make_patch_model(import_usable(path, 1), {.patch_count = patch_count});
}

std::string scene_name(const std::filesystem::path& scene) {
  return scene.stem().string();
}

std::string scene_name(const TransferData& data) {
  return scene_name(data.record.scene_name);
}

}  // namespace rebounce::bench

#include "rebounce/transfer_file.h"

#include "rebounce/error.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce {

std::shared_ptr<const TransferData> load_transfer(const std::filesystem::path& path) {
  return std::make_shared<const TransferData>(load_transfer_file(path));
}

std::shared_ptr<const TransferData> read_transfer(std::vector<std::byte> bytes,
                                                  const std::string& name) {
  return std::make_shared<const TransferData>(
      read_transfer_file(SafetensorsFile(SharedArray(std::move(bytes)), name)));
}

void save_transfer(const std::filesystem::path& path, const TransferData& data) {
  save_transfer_file(path, data);
}

const SceneData& scene_data(const TransferData& data) {
  return data;
}

OperatorInfo operator_info(const TransferData& data) {
  if (!data.transfer) return {};
  return {data.transfer->kind(), data.transfer->bytes(), data.transfer->bytes_per_apply()};
}

const PatchRoles& patch_roles(const TransferData& data) {
  if (!data.transfer) throw Error("the transfer data have no operator");
  return data.transfer->roles();
}

}  // namespace rebounce

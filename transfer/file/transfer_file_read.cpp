#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>

#include "rebounce/error.h"
#include "transfer/base/number_text.h"
#include "transfer/exchange/form_factor_blocks.h"
#include "transfer/file/checked_json.h"
#include "transfer/file/transfer_data_check.h"
#include "transfer/file/transfer_file_format.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/dense_operator.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {
namespace {

using nlohmann::json;

// Settings and reports nest by subject; those of valid files stay far below this.
constexpr std::size_t kRecordDepth = 16;

[[noreturn]] void refuse(const SafetensorsFile& file, const std::string& reason) {
  throw Error(file.name() + ": " + reason + "; make the file again");
}

const std::string& metadata(const SafetensorsFile& file, const char* name) {
  const auto found = file.metadata().find(name);
  if (found == file.metadata().end()) refuse(file, std::string("metadata ") + name + " is missing");
  return found->second;
}

/// Whether the file has a part that may be left out. `name`: of its tensor that is empty if the
/// part is, in which case a file has none of its tensors.
bool has_part(const SafetensorsFile& file, const char* name) {
  const auto found = file.tensors().find(name);
  if (found == file.tensors().end()) return false;
  const TensorShape& shape = found->second.shape;
  if (!shape.empty() && shape[0] == 0) {
    refuse(file, std::string("tensor ") + name + ": 0 rows, not at least 1");
  }
  return true;
}

template <typename Number>
Number number(const SafetensorsFile& file, const char* name) {
  const std::string& text = metadata(file, name);
  const char* end = text.data() + text.size();
  Number value{};
  const auto result = read_number(text.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end) {
    refuse(file, std::string("metadata ") + name + " is not a number");
  }
  return value;
}

/// `format` is the name of the format, `kind` what messages call such a file.
void check_version(const SafetensorsFile& file, const char* format, const char* kind) {
  const auto found = file.metadata().find(key::kFormat);
  if (found == file.metadata().end() || found->second != format) {
    throw Error(file.name() + " is not a " + kind + "; give one that Rebounce wrote");
  }
  const int version = number<int>(file, key::kFormatVersion);
  if (version != kFileFormatVersion) {
    throw Error(file.name() + " is of format version " + std::to_string(version) +
                ", and this program reads version " + std::to_string(kFileFormatVersion) +
                "; make the file again with this program");
  }
}

void check_checksum(const SafetensorsFile& file) {
  const auto bytes = file.prefix();
  const std::string_view prefix(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t digits = find_checksum_digits(prefix);
  if (digits == std::string_view::npos) refuse(file, "the checksum is missing");
  FileChecksum checksum(prefix, digits);
  checksum.update(file.data());
  if (checksum.text() != metadata(file, key::kChecksum)) {
    refuse(file, "the checksum does not match, the file is damaged");
  }
}

/// The largest byte that stores a flag or an enumerator of type `T`.
template <typename T>
constexpr std::uint8_t kLastByte = 0;
template <>
constexpr std::uint8_t kLastByte<bool> = 1;
template <>
constexpr std::uint8_t kLastByte<LightType> = static_cast<std::uint8_t>(LightType::kDirectional);
template <>
constexpr std::uint8_t kLastByte<AlphaMode> = static_cast<std::uint8_t>(AlphaMode::kBlend);
template <>
constexpr std::uint8_t kLastByte<TextureWrap> =
    static_cast<std::uint8_t>(TextureWrap::kMirroredRepeat);

/// Fills arrays, and members of arrays of structs, from tensors.
class TensorReader {
 public:
  explicit TensorReader(const SafetensorsFile& file) : file_(file) {}

  template <typename T>
  void operator()(const char* name, std::vector<T>& values) const {
    const auto scalars = scalars_of<T>(name, kAnySize);
    values.resize(scalars.size() / Stored<T>::kColumns);
    if (!values.empty()) std::memcpy(values.data(), scalars.data(), scalars.size_bytes());
  }

  template <typename Item, typename T>
  void operator()(const char* name, std::vector<Item>& items, T Item::*member) const {
    const auto scalars = scalars_of<T>(name, items.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
      assign(name, i, scalars.data() + i * Stored<T>::kColumns, items[i].*member);
    }
  }

  /// Reads a tensor that stores this member of every item.
  template <typename Item, typename T>
  std::size_t row_count(const char* name, T Item::* /*member*/) const {
    return scalars_of<T>(name, kAnySize).size() / Stored<T>::kColumns;
  }

 private:
  template <typename T>
  SharedArray<typename Stored<T>::Scalar> scalars_of(const char* name, std::uint64_t rows) const {
    return file_.tensor<typename Stored<T>::Scalar>(name, stored_shape<T>(rows));
  }

  template <typename T>
  void assign(const char* name, std::size_t entry, const typename Stored<T>::Scalar* from,
              T& to) const {
    if constexpr (std::is_enum_v<T> || std::is_same_v<T, bool>) {
      if (*from > kLastByte<T>) {
        refuse(file_, std::string("tensor ") + name + ": entry " + std::to_string(entry) + " is " +
                          std::to_string(*from) + ", not at most " + std::to_string(kLastByte<T>));
      }
      to = static_cast<T>(*from);
    } else {
      std::memcpy(&to, from, sizeof(T));
    }
  }

  const SafetensorsFile& file_;
};

void read_textures(const SafetensorsFile& file, std::vector<Texture>& textures) {
  for (std::size_t i = 0; i < textures.size(); ++i) {
    const auto encoded = file.tensor<std::uint8_t>(texture_tensor(i), {kAnySize});
    textures[i].encoded.assign(encoded.begin(), encoded.end());
  }
}

template <typename Item>
void read_names(const SafetensorsFile& file, const json& names, const char* kind,
                std::vector<Item>& items) {
  const json list = names.value(kind, json());
  if (!list.is_array() || list.size() != items.size()) {
    refuse(file, std::string("metadata names: there is not one for each of the ") + kind);
  }
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!list[i].is_string()) refuse(file, "metadata names: an entry is not a string");
    items[i].name = list[i].template get<std::string>();
  }
}

json parse_object(const SafetensorsFile& file, const char* name) {
  try {
    json value = parse_untrusted_json(metadata(file, name), kRecordDepth);
    if (!value.is_object()) throw Error("not an object");
    return value;
  } catch (const Error& error) {
    refuse(file, std::string("metadata ") + name + ": " + error.what());
  }
}

void read_scene(const SafetensorsFile& file, TransferData& data) {
  const TensorReader reader(file);
  data.materials.resize(reader.row_count("material.base_color", &Material::base_color));
  data.textures.resize(reader.row_count("texture.wrap_s", &Texture::wrap_s));
  data.cameras.resize(reader.row_count("camera.position", &Camera::position));
  data.lights.resize(reader.row_count("light.position", &Light::position));
  visit_tensors_of_scene(data, reader);
  read_textures(file, data.textures);
  const json names = parse_object(file, key::kNames);
  visit_named_items(data,
                    [&](const char* kind, auto& items) { read_names(file, names, kind, items); });
}

/// Empty if the file has no pairs.
ExchangeMatrix read_exchange(const SafetensorsFile& file) {
  if (!has_part(file, tensor::kRowBegin)) return {};
  return {file.tensor<std::uint64_t>(tensor::kRowBegin, {kAnySize}),
          file.tensor<std::uint32_t>(tensor::kColumn, {kAnySize}),
          file.tensor<float>(tensor::kExchangeArea, {kAnySize})};
}

/// Empty if the file has no links.
FormFactorLinks read_links(const SafetensorsFile& file, const PatchTable& patches) {
  FormFactorLinks links;
  if (!has_part(file, tensor::kLinksPatch)) return links;
  visit_tensors_of_links(links, TensorReader(file));
  try {
    check_links(links, patches.size());
  } catch (const Error& error) {
    refuse(file, error.what());
  }
  return links;
}

void read_record(const SafetensorsFile& file, TransferData& data) {
  visit_texts_of_build(data,
                       [&](const char* name, std::string& text) { text = metadata(file, name); });
  visit_numbers_of_record(data.record, [&](const char* name, double& value) {
    value = number<double>(file, name);
    if (!std::isfinite(value) || value < 0) {
      refuse(file, std::string("metadata ") + name + " is not finite and >= 0");
    }
  });
  for (const char* name : {"settings", "report"}) {
    if (!metadata(file, name).empty()) parse_object(file, name);
  }
}

/// Which of `matrix_count` matrices each channel uses.
std::array<std::uint32_t, kChannelCount> read_channel_matrix(const SafetensorsFile& file,
                                                             const char* name,
                                                             std::uint32_t matrix_count) {
  const auto stored = file.tensor<std::uint32_t>(name, {kChannelCount});
  std::array<std::uint32_t, kChannelCount> channel_matrix{};
  for (std::size_t channel = 0; channel < stored.size(); ++channel) {
    if (stored[channel] >= matrix_count) {
      refuse(file, std::string("tensor ") + name + ": a channel has no matrix");
    }
    channel_matrix[channel] = stored[channel];
  }
  return channel_matrix;
}

std::shared_ptr<const DenseOperator> read_dense_operator(const SafetensorsFile& file,
                                                         const std::vector<float>& area) {
  DenseOperator::Storage storage;
  storage.area = area;
  const TensorInfo& tiles = file.info(tensor::kDenseTiles);
  const TensorShape shape{kAnySize, DenseOperator::tile_count(area.size()), DenseOperator::kTile,
                          DenseOperator::kTile};
  if (tiles.type == TensorType::kF16) {
    storage.precision = Precision::kF16;
    storage.tiles_f16 = file.tensor<std::uint16_t>(tensor::kDenseTiles, shape, TensorType::kF16);
  } else {
    storage.tiles_f32 = file.tensor<float>(tensor::kDenseTiles, shape);
  }
  if (tiles.shape[0] < 1 || tiles.shape[0] > kChannelCount) {
    refuse(file, std::string("tensor ") + tensor::kDenseTiles +
                     ": the number of matrices is not 1, 2 or 3");
  }
  storage.matrix_count = static_cast<std::uint32_t>(tiles.shape[0]);
  storage.channel_matrix =
      read_channel_matrix(file, tensor::kDenseChannelMatrix, storage.matrix_count);
  try {
    return std::make_shared<const DenseOperator>(std::move(storage));
  } catch (const Error& error) {
    refuse(file, error.what());
  }
}

std::vector<TransferBlock> read_blocks(const SafetensorsFile& file, const char* name) {
  std::vector<StoredBlock> stored;
  TensorReader{file}(name, stored);
  std::vector<TransferBlock> blocks;
  blocks.reserve(stored.size());
  for (const StoredBlock& b : stored) {
    blocks.push_back(
        {b[0], b[1], b[2], b[3], static_cast<TransferBlock::Kind>(b[4]), b[5], b[6], b[7], b[8]});
  }
  return blocks;
}

/// Without the tensor, the operator serves all patches.
PatchRoles read_roles(const SafetensorsFile& file, const char* name, std::size_t patch_count) {
  if (name == nullptr || !file.tensors().contains(name)) return {};
  const auto stored = file.tensor<std::uint8_t>(name, {patch_count});
  PatchRoles roles;
  roles.role.assign(stored.begin(), stored.end());
  return roles;
}

std::shared_ptr<const HierarchicalOperator> read_hierarchical_operator(
    const SafetensorsFile& file, const HierarchicalTensors& names, const std::vector<float>& area) {
  HierarchicalStorage storage;
  storage.area = area;
  storage.order = HierarchicalStorage::Order::kStreamed;
  TensorReader{file}(names.patch, storage.patch);
  storage.blocks = read_blocks(file, names.blocks);
  storage.channel_matrix = read_channel_matrix(file, names.channel_matrix, kChannelCount);
  storage.matrix_count = 1 + std::ranges::max(storage.channel_matrix);
  storage.roles = read_roles(file, names.role, area.size());
  if (names.coefficient_scale != nullptr && file.tensors().contains(names.coefficient_scale)) {
    TensorReader{file}(names.coefficient_scale, storage.coefficient_scale);
  }
  if (names.scale_exponent != nullptr && file.tensors().contains(names.scale_exponent)) {
    const auto stored =
        file.tensor<std::int8_t>(names.scale_exponent, {area.size()}, TensorType::kI8);
    storage.scale_exponent.assign(stored.begin(), stored.end());
  }
  if (file.info(names.values).type == TensorType::kF16) {
    storage.precision = hierarchical_precision(Precision::kF16);
    storage.values_f16 = file.tensor<std::uint16_t>(names.values, {kAnySize}, TensorType::kF16);
  } else {
    storage.values_f32 = file.tensor<float>(names.values, {kAnySize});
  }
  if (file.tensors().contains(names.bases)) {
    storage.precision = hierarchical_precision(Precision::kQ8);
    storage.bases_q8 = file.tensor<std::int8_t>(names.bases, {kAnySize}, TensorType::kI8);
    storage.packed_couplings = file.tensor<std::uint8_t>(names.couplings, {kAnySize});
    TensorReader{file}(names.row_format, storage.row_format);
  }
  try {
    return std::make_shared<const HierarchicalOperator>(std::move(storage));
  } catch (const Error& error) {
    refuse(file, error.what());
  }
}

std::shared_ptr<const TransferOperator> read_operator(const SafetensorsFile& file,
                                                      const TransferData& data) {
  const std::vector<float>& area = data.patches.area;
  const std::span kinds(kOperatorKinds);
  const auto named =
      std::ranges::find(kinds, metadata(file, key::kOperator), &NamedOperatorKind::name);
  switch (named == kinds.end() ? OperatorKind::kNoOperator : named->kind) {
    case OperatorKind::kDense:
      return read_dense_operator(file, area);
    case OperatorKind::kHierarchical:
    case OperatorKind::kLowRank:
      return read_hierarchical_operator(file, kHierarchicalTransfer, area);
    case OperatorKind::kNoOperator:
      break;
  }
  refuse(file, "the operator is of a kind that this program does not know");
}

/// Null if the file holds none.
std::shared_ptr<const HierarchicalOperator> read_compressed_form_factors(
    const SafetensorsFile& file, const std::vector<float>& area) {
  const HierarchicalTensors& names = kCompressedFormFactors;
  if (!file.tensors().contains(names.values)) return nullptr;
  auto exchange = read_hierarchical_operator(file, names, area);
  if (exchange->storage().matrix_count != 1) {
    refuse(file, std::string("tensor ") + names.channel_matrix + ": more than one matrix");
  }
  return exchange;
}

/// A file without probes has none of their tensors.
void read_probes(const SafetensorsFile& file, TransferData& data) {
  if (!has_part(file, tensor::kProbePosition)) return;
  visit_tensors_of_probes(data.probes, TensorReader(file));
  if (has_part(file, tensor::kProbeSkyBegin)) {
    visit_tensors_of_probe_sky(data.probes.sky_cells, TensorReader(file));
  }
  const auto grid = file.tensor<std::uint32_t>(tensor::kProbeGrid, {3});
  std::ranges::copy(grid, data.probes.grid.begin());
  data.probes.patch_count = data.patches.size();
}

/// A file without surface harmonics has none of their tensors.
SurfaceHarmonics read_surface_harmonics(const SafetensorsFile& file) {
  SurfaceHarmonics harmonics;
  if (!has_part(file, tensor::kSurfaceSky)) return harmonics;
  visit_tensors_of_surface_harmonics(harmonics, TensorReader(file));
  if (has_part(file, tensor::kSurfaceSkyBegin)) {
    visit_tensors_of_surface_sky(harmonics.sky_cells, TensorReader(file));
  }
  return harmonics;
}

/// A file without rows of receivers has none of their tensors.
ReceiverRows read_receiver_rows(const SafetensorsFile& file, const tensor::RowNames& names) {
  ReceiverRows rows;
  if (!has_part(file, names.begin)) return rows;
  visit_tensors_of_receiver_rows(rows, names, TensorReader(file));
  const auto value = file.tensor<std::int8_t>(
      names.value, {ReceiverRows::kGroup * std::uint64_t{rows.entry_set.size()}}, TensorType::kI8);
  rows.value.assign(value.begin(), value.end());
  return rows;
}

/// A file without a lightmap has none of its tensors.
Lightmap read_lightmap(const SafetensorsFile& file) {
  Lightmap map;
  if (!has_part(file, tensor::kLightmapSize)) return map;
  visit_tensors_of_lightmap(map, TensorReader(file));
  const auto size = file.tensor<std::uint32_t>(tensor::kLightmapSize, {2});
  map.width = size[0];
  map.height = size[1];
  if (map.width == 0 || map.height == 0) {
    refuse(file, std::string("tensor ") + tensor::kLightmapSize + ": there are no texels");
  }
  return map;
}

}  // namespace

TransferData load_transfer_file(const std::filesystem::path& path) {
  return read_transfer_file(SafetensorsFile(path));
}

TransferData read_transfer_file(const SafetensorsFile& file) {
  check_version(file, kFormatName, "transfer file");
  check_checksum(file);

  TransferData data;
  visit_tensors_of_patches(data.patches, TensorReader(file));
  visit_tensors_of_mesh(data.mesh, TensorReader(file));
  if (has_part(file, tensor::kOpacityMap)) {
    visit_tensors_of_opacity(data.mesh.opacity, TensorReader(file));
  }
  read_scene(file, data);
  if (has_part(file, tensor::kSkyBegin)) {
    visit_tensors_of_sky(data.sky_cells, TensorReader(file));
  }
  read_probes(file, data);
  data.lightmap = read_lightmap(file);
  data.surface_harmonics = read_surface_harmonics(file);
  data.receiver_rows = read_receiver_rows(file, tensor::kVertexRows);
  data.texel_rows = read_receiver_rows(file, tensor::kTexelRows);
  if (has_part(file, tensor::kEmittedIrradiance)) {
    const TensorReader read(file);
    read(tensor::kEmittedIrradiance, data.emitted_irradiance);
  }
  data.exchange = read_exchange(file);
  read_record(file, data);
  check_transfer_data(data, file.name());
  data.links = read_links(file, data.patches);
  data.transfer = read_operator(file, data);
  data.compressed_form_factors = read_compressed_form_factors(file, data.patches.area);
  return data;
}

std::shared_ptr<const HierarchicalOperator> read_form_factor_file(const SafetensorsFile& file,
                                                                  const TransferData& data) {
  check_version(file, kFormFactorFormatName, "file of form factors");
  check_checksum(file);
  visit_texts_of_build(data, [&](const char* name, const std::string& text) {
    if (metadata(file, name) != text) {
      throw Error(file.name() + " was not made with this transfer file (another " + name +
                  "); make both again together");
    }
  });
  auto form_factors = read_compressed_form_factors(file, data.patches.area);
  if (form_factors == nullptr) refuse(file, "there are no form factors in it");
  return form_factors;
}

}  // namespace rebounce

#include <concepts>
#include <cstring>
#include <deque>
#include <nlohmann/json.hpp>

#include "rebounce/error.h"
#include "transfer/base/shortest_decimal.h"
#include "transfer/file/transfer_file_format.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/dense_operator.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {
namespace {

/// Collects tensors. Borrows arrays, copies members out of arrays of structs.
class TensorCollector {
 public:
  template <typename T>
  void add(std::string name, TensorShape shape, std::span<const T> values,
           TensorType type = tensor_type<T>()) {
    tensors_.push_back({std::move(name), type, std::move(shape), std::as_bytes(values)});
  }

  template <typename T>
  void operator()(const char* name, const std::vector<T>& values) {
    tensors_.push_back({name, tensor_type<typename Stored<T>::Scalar>(),
                        stored_shape<T>(values.size()), std::as_bytes(std::span(values))});
  }

  template <typename Item, typename T>
  void operator()(const char* name, const std::vector<Item>& items, T Item::*member) {
    std::vector<std::byte>& column = columns_.emplace_back(items.size() * sizeof(T));
    for (std::size_t i = 0; i < items.size(); ++i) {
      std::memcpy(column.data() + i * sizeof(T), &(items[i].*member), sizeof(T));
    }
    tensors_.push_back(
        {name, tensor_type<typename Stored<T>::Scalar>(), stored_shape<T>(items.size()), column});
  }

  /// Copies an array that only the file needs.
  template <typename T>
  void add_made(const char* name, std::span<const T> values) {
    const auto bytes = std::as_bytes(values);
    const std::vector<std::byte>& copy = columns_.emplace_back(bytes.begin(), bytes.end());
    tensors_.push_back(
        {name, tensor_type<typename Stored<T>::Scalar>(), stored_shape<T>(values.size()), copy});
  }

  const std::vector<TensorView>& tensors() const { return tensors_; }

 private:
  std::vector<TensorView> tensors_;
  std::deque<std::vector<std::byte>> columns_;
};

void collect_textures(const std::vector<Texture>& textures, TensorCollector& collector) {
  for (std::size_t i = 0; i < textures.size(); ++i) {
    const std::vector<std::uint8_t>& encoded = textures[i].encoded;
    collector.add<std::uint8_t>(texture_tensor(i), {encoded.size()}, encoded);
  }
}

/// Without pairs their tensors are left out.
void collect_exchange(const ExchangeMatrix& exchange, TensorCollector& collector) {
  if (exchange.empty()) return;
  collector.add(tensor::kRowBegin, {exchange.row_begin.size()}, exchange.row_begin.span());
  collector.add(tensor::kColumn, {exchange.column.size()}, exchange.column.span());
  collector.add(tensor::kExchangeArea, {exchange.exchange_area.size()},
                exchange.exchange_area.span());
}

void collect_dense_operator(const DenseOperator::Storage& storage, TensorCollector& collector) {
  const TensorShape shape{storage.matrix_count, DenseOperator::tile_count(storage.area.size()),
                          DenseOperator::kTile, DenseOperator::kTile};
  if (storage.precision == Precision::kF16) {
    collector.add(tensor::kDenseTiles, shape, storage.tiles_f16.span(), TensorType::kF16);
  } else {
    collector.add(tensor::kDenseTiles, shape, storage.tiles_f32.span());
  }
  collector.add<std::uint32_t>(tensor::kDenseChannelMatrix, {storage.channel_matrix.size()},
                               storage.channel_matrix);
}

/// The tensor type of values of a HierarchicalOperator. Unsigned 16-bit values are bits of halves.
template <typename Value>
constexpr TensorType value_type() {
  if constexpr (std::same_as<Value, std::uint16_t>) return TensorType::kF16;
  if constexpr (std::same_as<Value, std::int8_t>) return TensorType::kI8;
  if constexpr (std::same_as<Value, std::uint8_t>) return TensorType::kU8;
  if constexpr (std::same_as<Value, float>) return TensorType::kF32;
}

void collect_hierarchical_operator(const HierarchicalStorage& storage,
                                   const HierarchicalTensors& names, TensorCollector& collector) {
  std::vector<StoredBlock> blocks;
  for (const TransferBlock& b : storage.blocks) {
    blocks.push_back({b.row_begin, b.row_count, b.column_begin, b.column_count,
                      static_cast<std::uint32_t>(b.kind), b.row_rank, b.column_rank,
                      b.row_residual_rank, b.column_residual_rank});
  }
  collector.add_made<StoredBlock>(names.blocks, blocks);
  collector(names.patch, storage.patch);
  if (!storage.roles.all_are_both()) collector(names.role, storage.roles.role);
  if (!storage.coefficient_scale.empty())
    collector(names.coefficient_scale, storage.coefficient_scale);
  if (!storage.scale_exponent.empty()) {
    collector.add<std::int8_t>(names.scale_exponent, {storage.scale_exponent.size()},
                               storage.scale_exponent, TensorType::kI8);
  }
  collector.add<std::uint32_t>(names.channel_matrix, {storage.channel_matrix.size()},
                               storage.channel_matrix);
  const auto add = [&](const char* name) {
    return [&collector, name]<typename Value>(const SharedArray<Value>& array) {
      collector.add(name, {array.size()}, array.span(), value_type<Value>());
    };
  };
  if (!storage.one_array()) with_bases(storage, add(names.bases));
  with_couplings(storage, add(names.values));
  if (!storage.has_packed_couplings()) return;
  add(names.couplings)(storage.packed_couplings);
  collector(names.row_format, storage.row_format);
}

void collect_operator(const TransferOperator* transfer, TensorCollector& collector) {
  if (const auto* dense = dynamic_cast<const DenseOperator*>(transfer)) {
    collect_dense_operator(dense->storage(), collector);
  } else if (const auto* blocks = dynamic_cast<const HierarchicalOperator*>(transfer)) {
    collect_hierarchical_operator(blocks->storage(), kHierarchicalTransfer, collector);
  } else if (transfer == nullptr) {
    throw Error("the data have no operator, and a transfer file needs one; build them with one");
  } else {
    throw Error(
        "a transfer file cannot hold this kind of operator; give it one that the library has");
  }
}

/// Without probes their tensors are left out.
void collect_probes(const LightProbes& probes, TensorCollector& collector) {
  if (probes.size() == 0) return;
  visit_tensors_of_probes(probes, collector);
  if (!probes.sky_cells.empty()) visit_tensors_of_probe_sky(probes.sky_cells, collector);
  collector.add<std::uint32_t>(tensor::kProbeGrid, {probes.grid.size()}, probes.grid);
}

/// Without surface harmonics their tensors are left out.
void collect_surface_harmonics(const SurfaceHarmonics& harmonics, TensorCollector& collector) {
  if (harmonics.empty()) return;
  visit_tensors_of_surface_harmonics(harmonics, collector);
  if (!harmonics.sky_cells.empty()) visit_tensors_of_surface_sky(harmonics.sky_cells, collector);
}

/// Without a lightmap its tensors are left out.
void collect_lightmap(const Lightmap& map, TensorCollector& collector) {
  if (map.empty()) return;
  visit_tensors_of_lightmap(map, collector);
  const std::array<std::uint32_t, 2> size = {map.width, map.height};
  collector.add_made<std::uint32_t>(tensor::kLightmapSize, size);
}

/// Without rows of receivers their tensors are left out.
void collect_receiver_rows(const ReceiverRows& rows, const tensor::RowNames& names,
                           TensorCollector& collector) {
  if (rows.empty()) return;
  visit_tensors_of_receiver_rows(rows, names, collector);
  collector.add<std::int8_t>(names.value, {rows.value.size()}, rows.value, TensorType::kI8);
}

std::string names_text(const TransferData& data) {
  nlohmann::json names;
  visit_named_items(data, [&](const char* kind, const auto& items) {
    names[kind] = nlohmann::json::array();
    for (const auto& item : items) names[kind].push_back(item.name);
  });
  return names.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

SafetensorsMetadata make_metadata(const TransferData& data) {
  SafetensorsMetadata metadata{{key::kFormat, kFormatName},
                               {key::kFormatVersion, std::to_string(kFileFormatVersion)},
                               {key::kChecksum, zero_checksum()},
                               {key::kOperator, operator_name(data.transfer->kind())},
                               {key::kNames, names_text(data)}};
  visit_texts_of_build(data,
                       [&](const char* name, const std::string& text) { metadata[name] = text; });
  visit_numbers_of_record(data.record, [&](const char* name, double value) {
    metadata[name] = shortest_decimal(value);
  });
  return metadata;
}

/// Lays the tensors out and replaces the placeholder by the checksum of the whole file.
SafetensorsLayout sealed(const TensorCollector& collector, const SafetensorsMetadata& metadata) {
  SafetensorsLayout layout = lay_out_safetensors(collector.tensors(), metadata);
  const std::size_t digits = find_checksum_digits(layout.prefix);
  FileChecksum checksum(layout.prefix, digits);
  for (const TensorView& tensor : layout.tensors) checksum.update(tensor.bytes);
  const std::string text = checksum.text();
  layout.prefix.replace(digits, ContentHash::kDigitCount,
                        text.substr(text.size() - ContentHash::kDigitCount));
  return layout;
}

/// Calls take(layout) with the file of `data`.
void with_transfer_file(const TransferData& data, const auto& take) {
  TensorCollector collector;
  visit_tensors_of_patches(data.patches, collector);
  if (!data.emitted_irradiance.empty()) {
    collector(tensor::kEmittedIrradiance, data.emitted_irradiance);
  }
  visit_tensors_of_mesh(data.mesh, collector);
  if (!data.mesh.opacity.empty()) visit_tensors_of_opacity(data.mesh.opacity, collector);
  visit_tensors_of_scene(data, collector);
  collect_textures(data.textures, collector);
  if (!data.sky_cells.empty()) visit_tensors_of_sky(data.sky_cells, collector);
  collect_probes(data.probes, collector);
  collect_lightmap(data.lightmap, collector);
  collect_surface_harmonics(data.surface_harmonics, collector);
  collect_receiver_rows(data.receiver_rows, tensor::kVertexRows, collector);
  collect_receiver_rows(data.texel_rows, tensor::kTexelRows, collector);
  collect_exchange(data.exchange, collector);
  if (!data.links.empty()) visit_tensors_of_links(data.links, collector);
  collect_operator(data.transfer.get(), collector);
  if (data.compressed_form_factors) {
    collect_hierarchical_operator(data.compressed_form_factors->storage(), kCompressedFormFactors,
                                  collector);
  }

  take(sealed(collector, make_metadata(data)));
}

/// Calls take(layout) with the file of the compressed form factors of `data`.
void with_form_factor_file(const TransferData& data, const auto& take) {
  if (!data.compressed_form_factors) {
    throw Error("there are no compressed form factors to write; compress them first");
  }
  TensorCollector collector;
  collect_hierarchical_operator(data.compressed_form_factors->storage(), kCompressedFormFactors,
                                collector);
  SafetensorsMetadata metadata{{key::kFormat, kFormFactorFormatName},
                               {key::kFormatVersion, std::to_string(kFileFormatVersion)},
                               {key::kChecksum, zero_checksum()}};
  visit_texts_of_build(data,
                       [&](const char* name, const std::string& text) { metadata[name] = text; });
  take(sealed(collector, metadata));
}

}  // namespace

void write_transfer_file(const ByteSink& sink, const TransferData& data) {
  with_transfer_file(data, [&](const auto& layout) { write_safetensors(sink, layout); });
}

void save_transfer_file(const std::filesystem::path& path, const TransferData& data) {
  with_transfer_file(data, [&](const auto& layout) { write_safetensors(path, layout); });
}

void write_form_factor_file(const ByteSink& sink, const TransferData& data) {
  with_form_factor_file(data, [&](const auto& layout) { write_safetensors(sink, layout); });
}

void save_form_factor_file(const std::filesystem::path& path, const TransferData& data) {
  with_form_factor_file(data, [&](const auto& layout) { write_safetensors(path, layout); });
}

}  // namespace rebounce

#pragma once

// The names in a transfer file, shared by its writer, reader and checks.
// notes/reference/file_format.md explains them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "transfer/file/content_hash.h"
#include "transfer/file/safetensors.h"
#include "transfer/file/transfer_data.h"
#include "transfer/format/operator_format.h"

namespace rebounce {

inline constexpr char kFormatName[] = "rebounce transfer";
inline constexpr char kFormFactorFormatName[] = "rebounce form factors";

namespace key {
inline constexpr char kFormat[] = "format";
inline constexpr char kFormatVersion[] = "format_version";
inline constexpr char kChecksum[] = "checksum";
inline constexpr char kOperator[] = "operator";
inline constexpr char kNames[] = "names";
}  // namespace key

namespace tensor {
inline constexpr char kEmittedIrradiance[] = "patch.emitted_irradiance";
inline constexpr char kOpacityMap[] =
    "mesh.opacity_map";  // optional: without it there are no opacity maps
inline constexpr char kRowBegin[] = "form_factor.row_begin";
inline constexpr char kColumn[] = "form_factor.column";
inline constexpr char kExchangeArea[] = "form_factor.exchange_area";
inline constexpr char kLinksPatch[] = "links.patch";
inline constexpr char kProbePosition[] = "probe.position";
inline constexpr char kProbeGrid[] = "probe.grid";
inline constexpr char kProbeSkyBegin[] = "probe.sky_begin";
inline constexpr char kLightmapSize[] = "lightmap.size";
inline constexpr char kSkyBegin[] = "sky.entry_begin";
inline constexpr char kSurfaceSky[] = "surface_harmonics.sky";
inline constexpr char kSurfaceSkyBegin[] = "surface_harmonics.sky_begin";

/// Of ReceiverRows.
struct RowNames {
  const char *begin, *patch, *set, *entry_set, *scale, *receiver, *value;
};
inline constexpr RowNames kVertexRows = {
    "receiver.group_begin", "receiver.patch",  "receiver.set",  "receiver.entry_set",
    "receiver.scale",       "receiver.vertex", "receiver.value"};
inline constexpr RowNames kTexelRows = {"texel_receiver.group_begin", "texel_receiver.patch",
                                        "texel_receiver.set",         "texel_receiver.entry_set",
                                        "texel_receiver.scale",       "texel_receiver.texel",
                                        "texel_receiver.value"};
inline constexpr char kDenseTiles[] = "transfer.dense.tiles";
inline constexpr char kDenseChannelMatrix[] = "transfer.dense.channel_matrix";
}  // namespace tensor

/// The tensors of a hierarchical operator. Without `role` every patch has both roles.
struct HierarchicalTensors {
  const char *patch, *blocks, *bases, *couplings, *row_format, *values, *channel_matrix, *role,
      *coefficient_scale, *scale_exponent;
};

inline constexpr HierarchicalTensors kHierarchicalTransfer = {
    "transfer.hierarchical.patch",          "transfer.hierarchical.blocks",
    "transfer.hierarchical.bases",          "transfer.hierarchical.couplings",
    "transfer.hierarchical.row_format",     "transfer.hierarchical.values",
    "transfer.hierarchical.channel_matrix", "transfer.hierarchical.role",
    "transfer.hierarchical.moment_scale",   "transfer.hierarchical.scale_exponent"};
inline constexpr HierarchicalTensors kCompressedFormFactors = {
    "form_factor.hierarchical.patch",
    "form_factor.hierarchical.blocks",
    "form_factor.hierarchical.bases",
    "form_factor.hierarchical.couplings",
    "form_factor.hierarchical.row_format",
    "form_factor.hierarchical.values",
    "form_factor.hierarchical.channel_matrix",
    nullptr,
    nullptr,
    "form_factor.hierarchical.scale_exponent"};

/// A stored block of the hierarchical operator: the members of TransferBlock in their order.
using StoredBlock = std::array<std::uint32_t, 9>;

inline std::string texture_tensor(std::size_t texture) {
  return "texture." + std::to_string(texture);
}

/// How one entry of an array is stored: kColumns values of type `Scalar`.
template <typename T>
struct Stored {
  using Scalar = std::conditional_t<std::is_enum_v<T> || std::is_same_v<T, bool>, std::uint8_t, T>;
  static constexpr std::uint64_t kColumns = 1;
};
template <typename T, std::size_t N>
struct Stored<std::array<T, N>> {
  using Scalar = T;
  static constexpr std::uint64_t kColumns = N;
};

/// [rows] for scalars, [rows, columns] for others.
template <typename T>
TensorShape stored_shape(std::uint64_t rows) {
  if constexpr (Stored<T>::kColumns == 1)
    return {rows};
  else
    return {rows, Stored<T>::kColumns};
}

// Calls visit(name, array) for each tensor that is an array of the data.
template <typename Patches, typename Visit>
void visit_tensors_of_patches(Patches& patches, Visit&& visit) {
  visit("patch.area", patches.area);
  visit("patch.centroid", patches.centroid);
  visit("patch.normal", patches.normal);
  visit("patch.reflectance", patches.reflectance);
  visit("patch.emitted_exitance", patches.emitted_exitance);
  visit("patch.sky_visibility", patches.sky_visibility);
  visit("patch.absorbed", patches.absorbed);
}

template <typename Mesh, typename Visit>
void visit_tensors_of_mesh(Mesh& mesh, Visit&& visit) {
  visit("mesh.position", mesh.position);
  visit("mesh.normal", mesh.normal);
  visit("mesh.base_color_texcoord", mesh.base_color_texcoord);
  visit("mesh.emissive_texcoord", mesh.emissive_texcoord);
  visit("mesh.vertex_color", mesh.vertex_color);
  visit("mesh.triangle", mesh.triangle);
  visit("mesh.triangle_patch", mesh.triangle_patch);
  visit("mesh.triangle_material", mesh.triangle_material);
  visit("mesh.back_triangle", mesh.back_triangle);
  visit("mesh.weight_begin", mesh.weight_begin);
  visit("mesh.weight_patch", mesh.weight_patch);
  visit("mesh.weight", mesh.weight);
}

template <typename Probes, typename Visit>
void visit_tensors_of_probes(Probes& probes, Visit&& visit) {
  visit("probe.position", probes.position);
  visit("probe.valid", probes.valid);
  visit("probe.sky", probes.sky);
  visit("probe.entry_begin", probes.entry_begin);
  visit("probe.entry_patch", probes.entry_patch);
  visit("probe.entry_weight", probes.entry_weight);
}

template <typename Cells, typename Visit>
void visit_tensors_of_probe_sky(Cells& cells, Visit&& visit) {
  visit(tensor::kProbeSkyBegin, cells.entry_begin);
  visit("probe.sky_cell", cells.entry_cell);
  visit("probe.sky_weight", cells.entry_weight);
}

template <typename Cells, typename Visit>
void visit_tensors_of_sky(Cells& cells, Visit&& visit) {
  visit(tensor::kSkyBegin, cells.entry_begin);
  visit("sky.entry_cell", cells.entry_cell);
  visit("sky.entry_part", cells.entry_part);
}

template <typename Light, typename Visit>
void visit_tensors_of_surface_harmonics(Light& harmonics, Visit&& visit) {
  visit(tensor::kSurfaceSky, harmonics.sky);
  visit("surface_harmonics.entry_begin", harmonics.entry_begin);
  visit("surface_harmonics.entry_patch", harmonics.entry_patch);
  visit("surface_harmonics.entry_weight", harmonics.entry_weight);
}

template <typename Cells, typename Visit>
void visit_tensors_of_surface_sky(Cells& cells, Visit&& visit) {
  visit(tensor::kSurfaceSkyBegin, cells.entry_begin);
  visit("surface_harmonics.sky_cell", cells.entry_cell);
  visit("surface_harmonics.sky_weight", cells.entry_weight);
}

template <typename Map, typename Visit>
void visit_tensors_of_lightmap(Map& map, Visit&& visit) {
  visit("lightmap.texcoord", map.texcoord);
  visit("lightmap.has_texels", map.has_texels);
  visit("lightmap.triangle", map.triangle);
  visit("lightmap.weight", map.weight);
}

// All but the values.
template <typename Rows, typename Visit>
void visit_tensors_of_receiver_rows(Rows& rows, const tensor::RowNames& names, Visit&& visit) {
  visit(names.begin, rows.group_begin);
  visit(names.patch, rows.patch);
  visit(names.set, rows.set);
  visit(names.entry_set, rows.entry_set);
  visit(names.scale, rows.scale);
  visit(names.receiver, rows.receiver);
}

template <typename Maps, typename Visit>
void visit_tensors_of_opacity(Maps& maps, Visit&& visit) {
  visit(tensor::kOpacityMap, maps.triangle_map);
  visit("mesh.opacity_begin", maps.begin);
  visit("mesh.opacity", maps.opacity);
}

template <typename Links, typename Visit>
void visit_tensors_of_links(Links& links, Visit&& visit) {
  visit(tensor::kLinksPatch, links.patch);
  visit("links.first_child", links.first_child);
  visit("links.count", links.count);
  visit("links.pair", links.pair);
  visit("links.exchange_area", links.exchange_area);
  visit("links.gradient", links.gradient);
  visit("links.scale", links.scale);
}

// Calls visit(name, items, member) for each tensor that holds one member of every item of an array.
template <typename Data, typename Visit>
void visit_tensors_of_scene(Data& data, Visit&& visit) {
  visit("material.base_color", data.materials, &Material::base_color);
  visit("material.emitted_luminance", data.materials, &Material::emitted_luminance);
  visit("material.base_color_texture", data.materials, &Material::base_color_texture);
  visit("material.emissive_texture", data.materials, &Material::emissive_texture);
  visit("material.double_sided", data.materials, &Material::double_sided);
  visit("material.alpha_mode", data.materials, &Material::alpha_mode);
  visit("material.alpha_cutoff", data.materials, &Material::alpha_cutoff);
  visit("material.base_alpha", data.materials, &Material::base_alpha);
  visit("material.transmission", data.materials, &Material::transmission);
  visit("texture.wrap_s", data.textures, &Texture::wrap_s);
  visit("texture.wrap_t", data.textures, &Texture::wrap_t);
  visit("camera.position", data.cameras, &Camera::position);
  visit("camera.right", data.cameras, &Camera::right);
  visit("camera.up", data.cameras, &Camera::up);
  visit("camera.backward", data.cameras, &Camera::backward);
  visit("camera.vertical_fov", data.cameras, &Camera::vertical_fov);
  visit("light.type", data.lights, &Light::type);
  visit("light.position", data.lights, &Light::position);
  visit("light.direction", data.lights, &Light::direction);
  visit("light.color", data.lights, &Light::color);
  visit("light.intensity", data.lights, &Light::intensity);
  visit("light.range", data.lights, &Light::range);
  visit("light.inner_cone_angle", data.lights, &Light::inner_cone_angle);
  visit("light.outer_cone_angle", data.lights, &Light::outer_cone_angle);
}

// Calls visit(key, value) for each text about how the data were made, and for each number of their
// record.
template <typename Data, typename Visit>
void visit_texts_of_build(Data& data, Visit&& visit) {
  visit("generator", data.record.generator);
  visit("scene_name", data.record.scene_name);
  visit("scene_hash", data.record.scene_hash);
  visit("settings", data.settings_json);
  visit("report", data.report_json);
}

template <typename Record, typename Visit>
void visit_numbers_of_record(Record& record, Visit&& visit) {
  visit("solve_residual", record.solve_residual);
  visit("tolerance", record.tolerance);
  visit("error_mean", record.error_mean);
  visit("error_max", record.error_max);
  visit("error_bound", record.error_bound);
}

// Calls visit(kind, items) for each array whose items have names.
template <typename Data, typename Visit>
void visit_named_items(Data& data, Visit&& visit) {
  visit("materials", data.materials);
  visit("cameras", data.cameras);
  visit("lights", data.lights);
}

/// The offset of the checksum's digits in a file's prefix, or npos if they are not there exactly
/// once.
std::size_t find_checksum_digits(std::string_view prefix);

/// The checksum of a whole file: of `prefix`, with the checksum's own digits at `digits` replaced
/// by zeros, then of the data.
class FileChecksum {
 public:
  FileChecksum(std::string_view prefix, std::size_t digits);
  void update(std::span<const std::byte> data) { hash_.update(data); }
  std::string text() const { return hash_.text(); }

 private:
  ContentHash hash_;
};

/// The placeholder of the checksum.
std::string zero_checksum();

}  // namespace rebounce

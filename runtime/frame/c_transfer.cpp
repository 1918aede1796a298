// rebounce.h: transfer data, their tables, cameras and points.

#include <filesystem>
#include <string>

#include "rebounce/transfer_file.h"
#include "runtime/frame/c_handles.h"
#include "transfer/base/argument_check.h"

namespace rebounce::c {
namespace {

static_assert(REBOUNCE_PATCH_RECEIVER == PatchRoles::kReceiver);
static_assert(REBOUNCE_PATCH_SOURCE == PatchRoles::kSource);

// Sizes of structures in version 1 of the interface, up to their last member then. They stay the
// same when a structure grows: members that an older caller lacks get their defaults.
constexpr std::size_t kInfoSize1 = offsetof(rebounce_transfer_info, operator_bytes) +
                                   sizeof(rebounce_transfer_info::operator_bytes);
constexpr std::size_t kCameraSize1 =
    offsetof(rebounce_camera, backward) + sizeof(rebounce_camera::backward);
static_assert(kInfoSize1 == 48 && kCameraSize1 == 56);

/// Entry `index` of a list of the scene; null if there is none.
template <typename Entry>
const Entry* entry(const rebounce_transfer* transfer, std::vector<Entry> SceneData::*list,
                   std::uint32_t index) {
  if (transfer == nullptr || index >= (*transfer->data.*list).size()) return nullptr;
  return &(*transfer->data.*list)[index];
}

void copy_camera(const Camera& from, rebounce_camera& to) {
  to.vertical_fov = from.vertical_fov;
  std::ranges::copy(from.position, to.position);
  std::ranges::copy(from.right, to.right);
  std::ranges::copy(from.up, to.up);
  std::ranges::copy(from.backward, to.backward);
}

}  // namespace

extern "C" {

rebounce_status rebounce_transfer_load(const char* path, rebounce_transfer** transfer) {
  clear(transfer);
  if (path == nullptr || transfer == nullptr) return missing("rebounce_transfer_load");
  return guarded(REBOUNCE_BAD_INPUT, [&] {
    const auto* const utf8 = reinterpret_cast<const char8_t*>(path);
    auto handle = std::make_unique<rebounce_transfer>();
    handle->data = load_transfer(std::filesystem::path(std::u8string(utf8)));
    *transfer = handle.release();
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_transfer_read(const void* bytes, size_t size, const char* name,
                                       rebounce_transfer** transfer) {
  clear(transfer);
  if (bytes == nullptr || name == nullptr || transfer == nullptr) {
    return missing("rebounce_transfer_read");
  }
  return guarded(REBOUNCE_BAD_INPUT, [&] {
    const auto* const first = static_cast<const std::byte*>(bytes);
    auto handle = std::make_unique<rebounce_transfer>();
    handle->data = read_transfer({first, first + size}, name);
    *transfer = handle.release();
    return REBOUNCE_OK;
  });
}

void rebounce_transfer_retain(rebounce_transfer* transfer) {
  if (transfer != nullptr) transfer->references.fetch_add(1, std::memory_order_relaxed);
}

void rebounce_transfer_release(rebounce_transfer* transfer) {
  if (transfer == nullptr) return;
  if (transfer->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete transfer;
}

void rebounce_transfer_info_init_sized(rebounce_transfer_info* info, uint32_t struct_size) {
  init_sized(info, rebounce_transfer_info{}, struct_size);
}

rebounce_status rebounce_transfer_get_info(const rebounce_transfer* transfer,
                                           rebounce_transfer_info* info) {
  if (transfer == nullptr || info == nullptr) return missing("rebounce_transfer_get_info");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    auto filled = take(info, rebounce_transfer_info{}, kInfoSize1, "rebounce_transfer_info_init");
    const TransferData& data = *transfer->data;
    filled.patch_count = static_cast<std::uint32_t>(data.patches.size());
    filled.vertex_count = static_cast<std::uint32_t>(data.mesh.position.size());
    filled.triangle_count = static_cast<std::uint32_t>(data.mesh.triangle.size());
    filled.material_count = static_cast<std::uint32_t>(data.materials.size());
    filled.probe_count = static_cast<std::uint32_t>(data.probes.size());
    std::ranges::copy(data.probes.grid, filled.probe_grid);
    filled.operator_bytes = data.transfer->bytes();
    filled.lightmap_width = data.lightmap.width;
    filled.lightmap_height = data.lightmap.height;
    filled.camera_count = static_cast<std::uint32_t>(data.cameras.size());
    filled.error_mean = static_cast<float>(data.record.error_mean);
    filled.error_max = static_cast<float>(data.record.error_max);
    filled.error_bound = static_cast<float>(data.record.error_bound);
    give(filled, info);
    return REBOUNCE_OK;
  });
}

const float* rebounce_transfer_patch_area(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->patches.area.data();
}
const float* rebounce_transfer_patch_centroid(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(std::span(transfer->data->patches.centroid));
}
const float* rebounce_transfer_patch_normal(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(std::span(transfer->data->patches.normal));
}
const float* rebounce_transfer_patch_reflectance(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(std::span(transfer->data->patches.reflectance));
}
const float* rebounce_transfer_vertex_position(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(std::span(transfer->data->mesh.position));
}
const float* rebounce_transfer_vertex_normal(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(std::span(transfer->data->mesh.normal));
}
const uint32_t* rebounce_transfer_triangle(const rebounce_transfer* transfer) {
  if (transfer == nullptr || transfer->data->mesh.triangle.empty()) return nullptr;
  return transfer->data->mesh.triangle.front().data();
}
const uint32_t* rebounce_transfer_triangle_patch(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->mesh.triangle_patch.data();
}
const uint32_t* rebounce_transfer_triangle_material(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->mesh.triangle_material.data();
}
const uint32_t* rebounce_transfer_vertex_weight_begin(const rebounce_transfer* transfer) {
  if (transfer == nullptr || transfer->data->mesh.weight_begin.empty()) return nullptr;
  return transfer->data->mesh.weight_begin.data();
}
const uint32_t* rebounce_transfer_vertex_weight_patch(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->mesh.weight_patch.data();
}
const float* rebounce_transfer_vertex_weight(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->mesh.weight.data();
}
const char* rebounce_transfer_material_name(const rebounce_transfer* transfer, uint32_t material) {
  const Material* const found = entry(transfer, &SceneData::materials, material);
  return found == nullptr ? nullptr : found->name.c_str();
}
const float* rebounce_transfer_material_luminance(const rebounce_transfer* transfer,
                                                  uint32_t material) {
  const Material* const found = entry(transfer, &SceneData::materials, material);
  return found == nullptr ? nullptr : found->emitted_luminance.data();
}
const uint8_t* rebounce_transfer_patch_role(const rebounce_transfer* transfer) {
  if (transfer == nullptr) return nullptr;
  const PatchRoles& roles = transfer->data->transfer->roles();
  return roles.all_are_both() ? nullptr : roles.role.data();
}
const float* rebounce_transfer_probe_position(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : floats(std::span(transfer->data->probes.position));
}
const uint8_t* rebounce_transfer_probe_valid(const rebounce_transfer* transfer) {
  return transfer == nullptr ? nullptr : transfer->data->probes.valid.data();
}

const float* rebounce_transfer_lightmap_texcoord(const rebounce_transfer* transfer) {
  if (transfer == nullptr || transfer->data->lightmap.empty()) return nullptr;
  const std::vector<Float2>& texcoord = transfer->data->lightmap.texcoord;
  return texcoord.empty() ? nullptr : texcoord.front().data();
}
const uint8_t* rebounce_transfer_lightmap_triangle(const rebounce_transfer* transfer) {
  if (transfer == nullptr || transfer->data->lightmap.empty()) return nullptr;
  return transfer->data->lightmap.has_texels.data();
}

const char* rebounce_transfer_camera_name(const rebounce_transfer* transfer, uint32_t camera) {
  const Camera* const found = entry(transfer, &SceneData::cameras, camera);
  return found == nullptr ? nullptr : found->name.c_str();
}

void rebounce_camera_init_sized(rebounce_camera* camera, uint32_t struct_size) {
  rebounce_camera made{};
  copy_camera(Camera{}, made);
  init_sized(camera, made, struct_size);
}

rebounce_status rebounce_transfer_get_camera(const rebounce_transfer* transfer, uint32_t index,
                                             rebounce_camera* camera) {
  if (transfer == nullptr || camera == nullptr) return missing("rebounce_transfer_get_camera");
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    auto filled = take(camera, rebounce_camera{}, kCameraSize1, "rebounce_camera_init");
    const Camera* const found = entry(transfer, &SceneData::cameras, index);
    if (found == nullptr) {
      throw Error("there is no camera " + std::to_string(index) + "; the scene has " +
                  std::to_string(transfer->data->cameras.size()));
    }
    copy_camera(*found, filled);
    give(filled, camera);
    return REBOUNCE_OK;
  });
}

rebounce_status rebounce_transfer_receiver_points(const rebounce_transfer* transfer,
                                                  uint32_t points_per_patch, float* position,
                                                  float* normal, size_t point_count) {
  if (transfer == nullptr || position == nullptr || normal == nullptr) {
    return missing("rebounce_transfer_receiver_points");
  }
  return guarded(REBOUNCE_INVALID_ARGUMENT, [&] {
    const auto wanted = std::size_t{points_per_patch} * transfer->data->patches.size();
    check_size("the points of the patches", point_count, wanted);
    DirectLightingSettings settings;
    settings.points_per_patch = static_cast<int>(points_per_patch);
    for (const ReceiverPoint& point : receiver_points(*transfer->data, settings)) {
      position = std::ranges::copy(point.position, position).out;
      normal = std::ranges::copy(point.normal, normal).out;
    }
    return REBOUNCE_OK;
  });
}

}  // extern "C"

}  // namespace rebounce::c

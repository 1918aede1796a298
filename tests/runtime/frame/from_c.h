#pragma once

// A scene and its engine behind the C interface.

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>

#include "rebounce.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scene_data.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test {

class FromC : public testing::Test {
 protected:
  void SetUp() override {
    TransferData data;
    add_square(data, 1, 0, 4, true, {0.5F, 0.4F, 0.3F});
    add_square(data, 1, 2, 4, false, {0.2F, 0.7F, 0.9F});
    add_even_exchange(data);
    DisplayMesh& mesh = data.mesh;
    mesh.base_color_texcoord.resize(mesh.position.size());
    mesh.emissive_texcoord.resize(mesh.position.size());
    mesh.vertex_color.resize(mesh.position.size());
    add_weights(mesh);
    data.materials.resize(2);
    data.materials[0].name = "plaster";
    data.materials[1].name = "screen";
    data.materials[1].emitted_luminance = {1, 2, 3};
    data.mesh.triangle_material[5] = 1;
    data.cameras.resize(2);
    data.cameras[1].name = "door";
    data.cameras[1].position = {1, 2, 3};
    data.cameras[1].vertical_fov = 0.5F;
    data.record.error_mean = 0.25;
    data.record.error_max = 0.5;
    data.record.error_bound = 0.75;
    data.lightmap = one_texel_for_each(mesh);
    data.surface_harmonics.sky.assign(data.patches.size(), LinearHarmonics{1, 1});
    data.surface_harmonics.entry_begin.assign(data.patches.size() + 1, 0);
    add_zenith(data);
    const std::string path = (folder_ / "room.safetensors").string();
    save_transfer_file(path, data);
    ASSERT_EQ(rebounce_transfer_load(path.c_str(), &transfer_), REBOUNCE_OK);
    ASSERT_EQ(rebounce_engine_create(transfer_, nullptr, &engine_), REBOUNCE_OK);
    rebounce_light_init(&lamp_);
    lamp_.position[1] = 1;
  }
  void TearDown() override {
    rebounce_engine_destroy(engine_);
    rebounce_transfer_release(transfer_);
  }

  /// Each vertex is that of its patch, but the first, which takes it twice and subtracts the last.
  static void add_weights(DisplayMesh& mesh) {
    mesh.weight_begin = {0};
    const auto patch_count = static_cast<std::uint32_t>(mesh.position.size() / 3);
    for (std::uint32_t v = 0; v < mesh.position.size(); ++v) {
      mesh.weight_patch.push_back(v / 3);
      mesh.weight.push_back(v == 0 ? 2.0F : 1.0F);
      if (v == 0) {
        mesh.weight_patch.push_back(patch_count - 1);
        mesh.weight.push_back(-1.0F);
      }
      mesh.weight_begin.push_back(static_cast<std::uint32_t>(mesh.weight.size()));
    }
  }

  /// The bytes of the file of the transfer.
  std::string bytes() const {
    std::ifstream file(folder_ / "room.safetensors", std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  rebounce_transfer_info info() const {
    rebounce_transfer_info info;
    rebounce_transfer_info_init(&info);
    EXPECT_EQ(rebounce_transfer_get_info(transfer_, &info), REBOUNCE_OK);
    return info;
  }

  /// Every patch sees half of its sky in the zenith.
  static void add_zenith(TransferData& data) {
    data.sky_cells.entry_begin = {0};
    for (std::uint32_t i = 0; i < data.patches.size(); ++i) {
      data.sky_cells.entry_begin.push_back(i + 1);
      data.sky_cells.entry_cell.push_back(145);
      data.sky_cells.entry_part.push_back(0.5F);
    }
  }

  /// A lightmap of one row, with the middle of each triangle.
  static Lightmap one_texel_for_each(const DisplayMesh& mesh) {
    Lightmap map;
    map.width = static_cast<std::uint32_t>(mesh.triangle.size());
    map.height = 1;
    map.texcoord.assign(mesh.position.size(), Float2{0.5F, 0.5F});
    map.has_texels.assign(map.width, 1);
    map.weight.assign(map.width, Float2{1 / 3.0F, 1 / 3.0F});
    for (std::uint32_t t = 0; t < map.width; ++t) map.triangle.push_back(t);
    return map;
  }

  TemporaryFolder folder_;
  rebounce_transfer* transfer_ = nullptr;
  rebounce_engine* engine_ = nullptr;
  rebounce_light lamp_{};
};

}  // namespace rebounce::test

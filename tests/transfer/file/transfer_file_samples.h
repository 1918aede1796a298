#pragma once

// A transfer file with something in every field, and what it takes to see that all of it is kept.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "transfer/file/transfer_data.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce::test {

inline PatchTable sample_patches() {
  return {
      .area = {1, 0.5F, 2},
      .centroid = {{0, 0, 0}, {1, 2, 3}, {-1, 0.1F, 5}},
      .normal = {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
      .reflectance = {{0.5F, 0.25F, 0}, {0.999F, 0.1F, 0.2F}, {0, 0, 0}},
      .emitted_exitance = {{0, 0, 0}, {10, 20, 30}, {1e6F, 0, 0}},
      .sky_visibility = {0, 0.5F, 1},
      .absorbed = {1, 0, 0.25F},
  };
}

/// Two triangles of surface, the second of which has a second side.
inline DisplayMesh sample_mesh() {
  return {
      .position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
      .normal = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 1, 0}},
      .base_color_texcoord = {{0, 0}, {1, 0}, {0, 1}, {-3.5F, 7}},
      .emissive_texcoord = {{0.5F, 0}, {0.25F, 0}, {0, 1}, {1, 1}},
      .vertex_color = {{1, 1, 1}, {0.5F, 0.5F, 0.5F}, {0, 0, 0}, {1, 0, 1}},
      .triangle = {{0, 1, 2}, {1, 2, 3}, {3, 2, 1}},
      .triangle_patch = {0, 1, kNone},
      .triangle_material = {1, 0, 0},
      .back_triangle = {kNone, 2},
      .opacity = {{0, kNone, 1}, {0, 4, 5}, {0, 255, 128, 1, 25}},
      .weight_begin = {0, 2, 2, 3, 4},
      .weight_patch = {0, 2, 1, 2},
      .weight = {0.25F, 0.75F, 1, 1},
  };
}

inline ExchangeMatrix sample_exchange() {
  return {SharedArray(std::vector<std::uint64_t>{0, 2, 3, 3}),
          SharedArray(std::vector<std::uint32_t>{1, 2, 2}),
          SharedArray(std::vector<float>{0.25F, 0.125F, 0.0625F})};
}

inline std::vector<float> sample_tiles(std::size_t patches, std::uint32_t matrices) {
  std::vector<float> tiles(matrices * DenseOperator::tile_count(patches) * DenseOperator::kTile *
                           DenseOperator::kTile);
  for (std::size_t i = 0; i < tiles.size(); ++i) tiles[i] = static_cast<float>(i % 97) / 1024;
  return tiles;
}

inline std::shared_ptr<const DenseOperator> sample_operator(const std::vector<float>& area,
                                                            Precision precision) {
  DenseOperator::Storage storage;
  storage.area = area;
  storage.precision = precision;
  if (precision == Precision::kF32) {
    storage.matrix_count = 2;
    storage.channel_matrix = {0, 1, 0};
    storage.tiles_f32 = SharedArray(sample_tiles(area.size(), 2));
  } else {
    storage.matrix_count = 1;
    storage.tiles_f16 = SharedArray(DenseOperator::encode_half(sample_tiles(area.size(), 1)));
  }
  return std::make_shared<const DenseOperator>(std::move(storage));
}

inline TransferData sample_data(Precision precision = Precision::kF16) {
  TransferData data;
  data.patches = sample_patches();
  data.mesh = sample_mesh();
  data.materials = {{"white \"paint\"\n",
                     {1, 0.5F, 0},
                     {0, 0, 100},
                     1,
                     kNone,
                     true,
                     AlphaMode::kMask,
                     0.25F,
                     0.75F,
                     0},
                    {"Lampenschirm für Züge",
                     {0, 0, 0},
                     {1, 2, 3},
                     kNone,
                     0,
                     false,
                     AlphaMode::kBlend,
                     0.5F,
                     1,
                     0.9F}};
  data.textures = {{{1, 2, 3}, TextureWrap::kRepeat, TextureWrap::kClampToEdge},
                   {{0x89, 'P', 'N', 'G', 0}, TextureWrap::kMirroredRepeat, TextureWrap::kRepeat}};
  data.cameras = {{"front", {1, 2, 3}, {0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, 1.2F}};
  data.lights = {{LightType::kSpot,
                  "spot",
                  {1, 1, 1},
                  {0, 0, 1},
                  {1, 0.5F, 0},
                  80,
                  10,
                  0.1F,
                  0.7F,
                  0,
                  {0, 0},
                  {1, 0, 0},
                  nullptr},
                 {LightType::kDirectional,
                  "",
                  {0, 0, 0},
                  {1, 0, 0},
                  {1, 1, 1},
                  5,
                  0,
                  0,
                  0.5F,
                  0,
                  {0, 0},
                  {1, 0, 0},
                  nullptr}};
  data.emitted_irradiance = {{0.5F, 0.25F, 0}, {1, 2, 3}, {-1e-9F, 0, 7}};
  data.exchange = sample_exchange();
  data.transfer = sample_operator(data.patches.area, precision);
  data.record = {
      "rebounce 0.1.0", "room.glb", "xxh3:0123456789abcdef0123456789abcdef", 1e-7, 0.1, 1.0 / 3,
      5e-324,           0.015};
  data.settings_json = R"({"checksum":"xxh3:a trap","patches":3})";
  data.report_json = R"({"rays":12})";
  return data;
}

inline LightProbes sample_probes() {
  LightProbes probes;
  probes.position = {{0, 1, 2}, {3, 4, 5}};
  probes.valid = {1, 0};
  probes.sky = {Harmonics{1, 2, 3}, Harmonics{}};
  probes.entry_begin = {0, 3, 3};
  probes.entry_patch = {0, 1, 2};
  probes.entry_weight = {Harmonics{1}, Harmonics{0, -1}, Harmonics{2}};
  probes.sky_cells = {{0, 2, 2}, {0, 145}, {Harmonics{1}, Harmonics{2}}};
  probes.grid = {2, 1, 1};
  return probes;
}

/// Of 2 x 1 texels, for the four vertices and two triangles of sample_data.
inline Lightmap sample_lightmap(const TransferData& data) {
  Lightmap map;
  map.width = 2;
  map.height = 1;
  map.texcoord.assign(data.mesh.position.size(), Float2{0.5F, 1});
  map.has_texels.assign(data.mesh.triangle.size(), 1);
  map.triangle = {0, kNone};
  map.weight = {{0.25F, 0.5F}, {0, 0}};
  return map;
}

inline SkyCells sample_sky_cells() {
  return {{0, 1, 1, 3}, {145, 0, 7}, {0.5F, 0.25F, 1}};
}

inline SurfaceHarmonics sample_surface_harmonics() {
  SurfaceHarmonics light;
  light.sky.assign(3, LinearHarmonics{1, 2, 3, 4});
  light.entry_begin = {0, 2, 2, 3};
  light.entry_patch = {1, 2, 0};
  light.entry_weight.assign(3, LinearHarmonics{1});
  light.sky_cells = {{0, 0, 1, 1}, {7}, {LinearHarmonics{1}}};
  return light;
}

/// Two groups, of 4 and of no sets.
inline ReceiverRows sample_receiver_rows() {
  ReceiverRows rows;
  rows.patch = {2, 0, 1};
  rows.set = {{0, 2}, {2, 3}};
  rows.group_begin = {0, 4, 4};
  rows.entry_set = {0, 1, 1, 0};
  rows.scale = {0.5F, 0.25F, 0, 1};
  rows.receiver.assign(2 * std::size_t{ReceiverRows::kGroup}, kNone);
  rows.receiver[1] = 3;
  rows.receiver[64] = 0;
  for (int k = 0; k < 4 * 64; ++k) rows.value.push_back(static_cast<std::int8_t>(k - 128));
  return rows;
}

/// Of the one texel of the sample that shows something.
inline ReceiverRows sample_texel_rows() {
  ReceiverRows rows = sample_receiver_rows();
  rows.receiver.assign(rows.receiver.size(), kNone);
  rows.receiver[5] = 0;
  return rows;
}

/// With all that a file may do without.
inline TransferData full_sample_data(Precision precision = Precision::kF16) {
  TransferData data = sample_data(precision);
  data.sky_cells = sample_sky_cells();
  data.probes = sample_probes();
  data.probes.patch_count = data.patches.size();
  data.lightmap = sample_lightmap(data);
  data.surface_harmonics = sample_surface_harmonics();
  data.receiver_rows = sample_receiver_rows();
  data.texel_rows = sample_texel_rows();
  return data;
}

/// What can be compared and printed.
template <typename T>
const T& plain(const T& value) {
  return value;
}
template <typename T>
std::vector<T> plain(const SharedArray<T>& array) {
  return {array.begin(), array.end()};
}

/// Fails the test where one of these members differs.
template <typename T, typename... Member>
void expect_same(const T& a, const T& b, Member T::*... member) {
  int number = 0;
  const auto compare = [&](auto m) {
    EXPECT_EQ(plain(a.*m), plain(b.*m)) << "member " << number;
    ++number;
  };
  (compare(member), ...);
}

inline void expect_equal(const PatchTable& a, const PatchTable& b) {
  expect_same(a, b, &PatchTable::area, &PatchTable::centroid, &PatchTable::normal,
              &PatchTable::reflectance, &PatchTable::emitted_exitance, &PatchTable::sky_visibility,
              &PatchTable::absorbed);
}

inline void expect_equal(const DisplayMesh& a, const DisplayMesh& b) {
  expect_same(a, b, &DisplayMesh::position, &DisplayMesh::normal, &DisplayMesh::base_color_texcoord,
              &DisplayMesh::emissive_texcoord, &DisplayMesh::vertex_color, &DisplayMesh::triangle,
              &DisplayMesh::triangle_patch, &DisplayMesh::triangle_material,
              &DisplayMesh::back_triangle, &DisplayMesh::weight_begin, &DisplayMesh::weight_patch,
              &DisplayMesh::weight);
  expect_same(a.opacity, b.opacity, &OpacityMaps::triangle_map, &OpacityMaps::begin,
              &OpacityMaps::opacity);
}

inline void expect_equal(const Material& a, const Material& b) {
  expect_same(a, b, &Material::name, &Material::base_color, &Material::emitted_luminance,
              &Material::base_color_texture, &Material::emissive_texture, &Material::double_sided,
              &Material::alpha_mode, &Material::alpha_cutoff, &Material::base_alpha,
              &Material::transmission);
}

inline void expect_equal(const Texture& a, const Texture& b) {
  expect_same(a, b, &Texture::encoded, &Texture::wrap_s, &Texture::wrap_t);
}

inline void expect_equal(const Camera& a, const Camera& b) {
  expect_same(a, b, &Camera::name, &Camera::position, &Camera::right, &Camera::up,
              &Camera::backward, &Camera::vertical_fov);
}

inline void expect_equal(const Light& a, const Light& b) {
  expect_same(a, b, &Light::type, &Light::name, &Light::position, &Light::direction, &Light::color,
              &Light::intensity, &Light::range, &Light::inner_cone_angle, &Light::outer_cone_angle);
}

template <typename Item>
void expect_equal(const std::vector<Item>& a, const std::vector<Item>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) expect_equal(a[i], b[i]);
}

inline void expect_equal(const ExchangeMatrix& a, const ExchangeMatrix& b) {
  expect_same(a, b, &ExchangeMatrix::row_begin, &ExchangeMatrix::column,
              &ExchangeMatrix::exchange_area);
}

inline void expect_equal(const TransferOperator& a, const TransferOperator& b) {
  using Storage = DenseOperator::Storage;
  expect_same(dynamic_cast<const DenseOperator&>(a).storage(),
              dynamic_cast<const DenseOperator&>(b).storage(), &Storage::area,
              &Storage::channel_matrix, &Storage::matrix_count, &Storage::precision,
              &Storage::tiles_f32, &Storage::tiles_f16);
}

inline void expect_equal(const BuildRecord& a, const BuildRecord& b) {
  expect_same(a, b, &BuildRecord::generator, &BuildRecord::scene_name, &BuildRecord::scene_hash,
              &BuildRecord::solve_residual, &BuildRecord::tolerance, &BuildRecord::error_mean,
              &BuildRecord::error_max, &BuildRecord::error_bound);
}

inline void expect_equal(const SkyCells& a, const SkyCells& b) {
  expect_same(a, b, &SkyCells::entry_begin, &SkyCells::entry_cell, &SkyCells::entry_part);
}

template <typename Weight>
void expect_equal(const SkyHarmonics<Weight>& a, const SkyHarmonics<Weight>& b) {
  using Cells = SkyHarmonics<Weight>;
  expect_same(a, b, &Cells::entry_begin, &Cells::entry_cell, &Cells::entry_weight);
}

inline void expect_equal(const LightProbes& a, const LightProbes& b) {
  expect_same(a, b, &LightProbes::position, &LightProbes::valid, &LightProbes::sky,
              &LightProbes::entry_begin, &LightProbes::entry_patch, &LightProbes::entry_weight,
              &LightProbes::grid, &LightProbes::patch_count);
  expect_equal(a.sky_cells, b.sky_cells);
}

inline void expect_equal(const SurfaceHarmonics& a, const SurfaceHarmonics& b) {
  using Light = SurfaceHarmonics;
  expect_same(a, b, &Light::sky, &Light::entry_begin, &Light::entry_patch, &Light::entry_weight);
  expect_equal(a.sky_cells, b.sky_cells);
}

inline void expect_equal(const Lightmap& a, const Lightmap& b) {
  expect_same(a, b, &Lightmap::width, &Lightmap::height, &Lightmap::texcoord, &Lightmap::has_texels,
              &Lightmap::triangle, &Lightmap::weight);
}

inline void expect_equal(const ReceiverRows& a, const ReceiverRows& b) {
  expect_same(a, b, &ReceiverRows::patch, &ReceiverRows::set, &ReceiverRows::group_begin,
              &ReceiverRows::entry_set, &ReceiverRows::scale, &ReceiverRows::receiver,
              &ReceiverRows::value);
}

inline void expect_equal(const TransferData& a, const TransferData& b) {
  expect_equal(a.receiver_rows, b.receiver_rows);
  expect_equal(a.texel_rows, b.texel_rows);
  expect_equal(a.sky_cells, b.sky_cells);
  expect_equal(a.probes, b.probes);
  expect_equal(a.lightmap, b.lightmap);
  expect_equal(a.surface_harmonics, b.surface_harmonics);
  expect_equal(a.patches, b.patches);
  expect_equal(a.mesh, b.mesh);
  expect_equal(a.materials, b.materials);
  expect_equal(a.textures, b.textures);
  expect_equal(a.cameras, b.cameras);
  expect_equal(a.lights, b.lights);
  EXPECT_EQ(a.emitted_irradiance, b.emitted_irradiance);
  expect_equal(a.exchange, b.exchange);
  expect_equal(*a.transfer, *b.transfer);
  expect_equal(a.record, b.record);
  EXPECT_EQ(a.settings_json, b.settings_json);
  EXPECT_EQ(a.report_json, b.report_json);
}

}  // namespace rebounce::test

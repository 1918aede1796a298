#include "transfer/file/transfer_file_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "tests/support/expect_error.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/transfer_file_tampering.h"
#include "transfer/file/content_hash.h"
#include "transfer/file/safetensors.h"
#include "transfer/operator/dense_operator.h"

namespace rebounce {
namespace {

using test::expect_error;
using test::prefix_size;
using test::reseal;
using test::use;
using Names = std::vector<std::string>;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

PatchTable sample_patches() {
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
DisplayMesh sample_mesh() {
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

ExchangeMatrix sample_exchange() {
  return {SharedArray(std::vector<std::uint64_t>{0, 2, 3, 3}),
          SharedArray(std::vector<std::uint32_t>{1, 2, 2}),
          SharedArray(std::vector<float>{0.25F, 0.125F, 0.0625F})};
}

std::vector<float> sample_tiles(std::size_t patches, std::uint32_t matrices) {
  std::vector<float> tiles(matrices * DenseOperator::tile_count(patches) * DenseOperator::kTile *
                           DenseOperator::kTile);
  for (std::size_t i = 0; i < tiles.size(); ++i) tiles[i] = static_cast<float>(i % 97) / 1024;
  return tiles;
}

std::shared_ptr<const DenseOperator> sample_operator(const std::vector<float>& area,
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

TransferData sample_data(Precision precision = Precision::kF16) {
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

template <typename T>
std::vector<T> to_vector(const SharedArray<T>& array) {
  return {array.begin(), array.end()};
}

void expect_equal(const PatchTable& a, const PatchTable& b) {
  EXPECT_EQ(a.area, b.area);
  EXPECT_EQ(a.centroid, b.centroid);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.reflectance, b.reflectance);
  EXPECT_EQ(a.emitted_exitance, b.emitted_exitance);
  EXPECT_EQ(a.sky_visibility, b.sky_visibility);
  EXPECT_EQ(a.absorbed, b.absorbed);
}

void expect_equal(const DisplayMesh& a, const DisplayMesh& b) {
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.base_color_texcoord, b.base_color_texcoord);
  EXPECT_EQ(a.emissive_texcoord, b.emissive_texcoord);
  EXPECT_EQ(a.vertex_color, b.vertex_color);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.triangle_patch, b.triangle_patch);
  EXPECT_EQ(a.triangle_material, b.triangle_material);
  EXPECT_EQ(a.back_triangle, b.back_triangle);
  EXPECT_EQ(a.opacity.triangle_map, b.opacity.triangle_map);
  EXPECT_EQ(a.opacity.begin, b.opacity.begin);
  EXPECT_EQ(a.opacity.opacity, b.opacity.opacity);
  EXPECT_EQ(a.weight_begin, b.weight_begin);
  EXPECT_EQ(a.weight_patch, b.weight_patch);
  EXPECT_EQ(a.weight, b.weight);
}

void expect_equal(const Material& a, const Material& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.base_color, b.base_color);
  EXPECT_EQ(a.emitted_luminance, b.emitted_luminance);
  EXPECT_EQ(a.base_color_texture, b.base_color_texture);
  EXPECT_EQ(a.emissive_texture, b.emissive_texture);
  EXPECT_EQ(a.double_sided, b.double_sided);
  EXPECT_EQ(a.alpha_mode, b.alpha_mode);
  EXPECT_EQ(a.alpha_cutoff, b.alpha_cutoff);
  EXPECT_EQ(a.base_alpha, b.base_alpha);
  EXPECT_EQ(a.transmission, b.transmission);
}

void expect_equal(const Texture& a, const Texture& b) {
  EXPECT_EQ(a.encoded, b.encoded);
  EXPECT_EQ(a.wrap_s, b.wrap_s);
  EXPECT_EQ(a.wrap_t, b.wrap_t);
}

void expect_equal(const Camera& a, const Camera& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.right, b.right);
  EXPECT_EQ(a.up, b.up);
  EXPECT_EQ(a.backward, b.backward);
  EXPECT_EQ(a.vertical_fov, b.vertical_fov);
}

void expect_equal(const Light& a, const Light& b) {
  EXPECT_EQ(a.type, b.type);
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.direction, b.direction);
  EXPECT_EQ(a.color, b.color);
  EXPECT_EQ(a.intensity, b.intensity);
  EXPECT_EQ(a.range, b.range);
  EXPECT_EQ(a.inner_cone_angle, b.inner_cone_angle);
  EXPECT_EQ(a.outer_cone_angle, b.outer_cone_angle);
}

template <typename Item>
void expect_equal(const std::vector<Item>& a, const std::vector<Item>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) expect_equal(a[i], b[i]);
}

void expect_equal(const ExchangeMatrix& a, const ExchangeMatrix& b) {
  EXPECT_EQ(to_vector(a.row_begin), to_vector(b.row_begin));
  EXPECT_EQ(to_vector(a.column), to_vector(b.column));
  EXPECT_EQ(to_vector(a.exchange_area), to_vector(b.exchange_area));
}

void expect_equal(const TransferOperator& a, const TransferOperator& b) {
  const auto& storage_a = dynamic_cast<const DenseOperator&>(a).storage();
  const auto& storage_b = dynamic_cast<const DenseOperator&>(b).storage();
  EXPECT_EQ(storage_a.area, storage_b.area);
  EXPECT_EQ(storage_a.channel_matrix, storage_b.channel_matrix);
  EXPECT_EQ(storage_a.matrix_count, storage_b.matrix_count);
  EXPECT_EQ(storage_a.precision, storage_b.precision);
  EXPECT_EQ(to_vector(storage_a.tiles_f32), to_vector(storage_b.tiles_f32));
  EXPECT_EQ(to_vector(storage_a.tiles_f16), to_vector(storage_b.tiles_f16));
}

void expect_equal(const BuildRecord& a, const BuildRecord& b) {
  EXPECT_EQ(a.generator, b.generator);
  EXPECT_EQ(a.scene_name, b.scene_name);
  EXPECT_EQ(a.scene_hash, b.scene_hash);
  EXPECT_EQ(a.solve_residual, b.solve_residual);
  EXPECT_EQ(a.tolerance, b.tolerance);
  EXPECT_EQ(a.error_mean, b.error_mean);
  EXPECT_EQ(a.error_max, b.error_max);
  EXPECT_EQ(a.error_bound, b.error_bound);
}

void expect_equal(const TransferData& a, const TransferData& b) {
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

void replace_in_file(const std::filesystem::path& path, const std::string& from,
                     const std::string& to) {
  std::string file = test::read_bytes(path);
  const std::size_t at = file.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  ASSERT_EQ(from.size(), to.size());
  file.replace(at, from.size(), to);
  reseal(file);
  test::write_bytes(path, file);
}

TEST(TransferFile, RoundTripsEveryField) {
  for (const Precision precision : {Precision::kF16, Precision::kF32}) {
    const test::TemporaryFolder folder;
    const TransferData data = sample_data(precision);
    save_transfer_file(folder / "file", data);
    expect_equal(load_transfer_file(folder / "file"), data);
    EXPECT_EQ(folder.names(), Names{"file"});
  }
}

TEST(TransferFile, RoundTripsASceneWithoutMeshTexturesCamerasOrLights) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  data.mesh = {};
  data.mesh.weight_begin = {0};
  data.materials.clear();
  data.textures.clear();
  data.cameras.clear();
  data.lights.clear();
  data.exchange = {SharedArray(std::vector<std::uint64_t>(4)), {}, {}};
  data.record = {};
  data.settings_json.clear();
  data.report_json.clear();
  save_transfer_file(folder / "file", data);
  expect_equal(load_transfer_file(folder / "file"), data);
}

TEST(TransferFile, LoadedDataWork) {
  const test::TemporaryFolder folder;
  const TransferData data = sample_data();
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  const std::vector<Float3> light(data.patches.size(), {1, 2, 3});
  EXPECT_EQ(product(*loaded.transfer, light), product(*data.transfer, light));
}

TEST(TransferFile, MapsTheLargeTensorsAlignedInsteadOfCopyingThem) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data(Precision::kF32));
  const TransferData data = load_transfer_file(folder / "file");
  const auto& storage = dynamic_cast<const DenseOperator&>(*data.transfer).storage();
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(storage.tiles_f32.data()) % 64, 0U);
  EXPECT_EQ(storage.tiles_f32.owner(), data.exchange.column.owner()) << "one mapping for all";
}

TEST(TransferFile, IsTheSameBytesEveryTime) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "first", sample_data());
  save_transfer_file(folder / "second", load_transfer_file(folder / "first"));
  EXPECT_EQ(test::read_bytes(folder / "first"), test::read_bytes(folder / "second"));
}

TEST(TransferFile, SealsAsDocumented) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  std::string file = test::read_bytes(folder / "file");
  const std::string written = file;
  reseal(file);
  EXPECT_EQ(file, written);
}

TEST(TransferFile, RefusesAnotherVersionWithBothNumbers) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  std::string file = test::read_bytes(folder / "file");
  const std::string entry = "\"format_version\":\"";
  file[file.find(entry) + entry.size()] = '9';
  test::write_bytes(folder / "file",
                    file);  // not sealed again: a version speaks before its checksum
  expect_error([&] { load_transfer_file(folder / "file"); },
               "is of format version 9, and this program reads version " +
                   std::to_string(kFileFormatVersion));
}

TEST(TransferFile, RefusesOtherFiles) {
  const test::TemporaryFolder folder;
  expect_error([&] { load_transfer_file(folder / "none"); }, "cannot read");
  write_safetensors(folder / "other", lay_out_safetensors({}, {{"format", "pt"}}));
  expect_error([&] { load_transfer_file(folder / "other"); }, "is not a transfer file");
  write_safetensors(
      folder / "unsealed",
      lay_out_safetensors({}, {{"format", "rebounce transfer"},
                               {"format_version", std::to_string(kFileFormatVersion)}}));
  expect_error([&] { load_transfer_file(folder / "unsealed"); }, "checksum is missing");
}

// Every bit of the prefix, and one bit of every byte of the tensors: the checksum treats those
// alike.
TEST(TransferFile, RefusesAnyFlippedBit) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const std::string file = test::read_bytes(folder / "file");
  const std::size_t prefix = prefix_size(file);
  std::fstream stream(folder / "file", std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&](std::size_t at, char byte) {
    stream.seekp(static_cast<std::streamoff>(at));
    stream.put(byte);
    stream.flush();
  };
  std::size_t accepted = 0;
  for (std::size_t bit = 0; bit < 8 * file.size(); bit += bit < 8 * prefix ? 1 : 9) {
    const std::size_t at = bit / 8;
    put(at, static_cast<char>(file[at] ^ (1 << bit % 8)));
    try {
      load_transfer_file(folder / "file");
      ADD_FAILURE() << "bit " << bit % 8 << " of byte " << at;
      ++accepted;
    } catch (const Error&) {
    }
    put(at, file[at]);
    ASSERT_LT(accepted, 10U);
  }
  EXPECT_NO_THROW(load_transfer_file(folder / "file")) << "every flip was undone";
}

TEST(TransferFile, RefusesAFileCutShort) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "whole", sample_data());
  const std::string file = test::read_bytes(folder / "whole");
  for (std::size_t size = 0; size < file.size(); size += 97) {
    test::write_bytes(folder / "cut", file.substr(0, size));
    EXPECT_THROW(load_transfer_file(folder / "cut"), Error) << size;
  }
}

struct Corruption {
  const char* message;  ///< a part of it
  std::function<void(TransferData&)> corrupt;
};

void expect_refused(const std::vector<Corruption>& corruptions) {
  const test::TemporaryFolder folder;
  for (std::size_t i = 0; i < corruptions.size(); ++i) {
    SCOPED_TRACE("corruption " + std::to_string(i) + ": " + corruptions[i].message);
    TransferData data = sample_data();
    corruptions[i].corrupt(data);
    save_transfer_file(folder / "file", data);
    expect_error([&] { load_transfer_file(folder / "file"); }, corruptions[i].message);
  }
}

TEST(TransferFile, RefusesImpossiblePatches) {
  const auto patches = [](auto change) {
    return [change](TransferData& data) { change(data.patches); };
  };
  expect_refused({
      {"patch.area: entry 1 is 0, not finite and > 0", patches([](auto& p) { p.area[1] = 0; })},
      {"patch.area", patches([](auto& p) { p.area[1] = -1; })},
      {"patch.area", patches([](auto& p) { p.area[1] = kInfinity; })},
      {"patch.area: entry 2 is nan", patches([](auto& p) { p.area[2] = kNan; })},
      {"patch.centroid", patches([](auto& p) { p.centroid[1][2] = kNan; })},
      {"patch.centroid: 2 rows, not 3", patches([](auto& p) { p.centroid.pop_back(); })},
      {"patch.normal", patches([](auto& p) { p.normal[2][0] = kInfinity; })},
      {"patch.reflectance: entry 0 is 1, not in [0, 1)",
       patches([](auto& p) { p.reflectance[0][1] = 1; })},
      {"patch.reflectance", patches([](auto& p) { p.reflectance[0][1] = -0.1F; })},
      {"patch.reflectance", patches([](auto& p) { p.reflectance[0][1] = kNan; })},
      {"patch.emitted_exitance", patches([](auto& p) { p.emitted_exitance[0][1] = -1; })},
      {"patch.sky_visibility", patches([](auto& p) { p.sky_visibility[0] = 1.5F; })},
      {"patch.absorbed", patches([](auto& p) { p.absorbed[0] = kNan; })},
      {"there are no patches", [](TransferData& data) { data.patches = {}; }},
  });
}

TEST(TransferFile, RefusesAnImpossibleMesh) {
  const auto mesh = [](auto change) { return [change](TransferData& data) { change(data.mesh); }; };
  expect_refused({
      {"mesh.position", mesh([](auto& m) { m.position[3][0] = kNan; })},
      {"mesh.normal: 3 rows, not 4", mesh([](auto& m) { m.normal.pop_back(); })},
      {"mesh.normal", mesh([](auto& m) { m.normal[0][0] = kNan; })},
      {"mesh.base_color_texcoord", mesh([](auto& m) { m.base_color_texcoord[0][0] = kNan; })},
      {"mesh.emissive_texcoord", mesh([](auto& m) { m.emissive_texcoord[0][0] = kInfinity; })},
      {"mesh.vertex_color", mesh([](auto& m) { m.vertex_color[0][0] = -1; })},
      {"mesh.triangle: entry 2 is 4, not below 4", mesh([](auto& m) { m.triangle[2][1] = 4; })},
      {"mesh.triangle", mesh([](auto& m) { m.triangle[0][0] = kNone; })},
      {"mesh.triangle_patch", mesh([](auto& m) { m.triangle_patch[0] = 3; })},
      {"mesh.triangle_patch", mesh([](auto& m) { m.triangle_patch.pop_back(); })},
      {"mesh.triangle_material", mesh([](auto& m) { m.triangle_material[1] = 2; })},
      {"mesh.triangle_material", mesh([](auto& m) { m.triangle_material[1] = kNone; })},
      {"mesh.back_triangle", mesh([](auto& m) { m.back_triangle[0] = 3; })},
      {"mesh.back_triangle: entry 0 is 1, not after the surface",
       mesh([](auto& m) { m.back_triangle[0] = 1; })},
      {"mesh.back_triangle", mesh([](auto& m) { m.back_triangle.resize(4, kNone); })},
      {"mesh.opacity_map: 2 rows, not 3", mesh([](auto& m) { m.opacity.triangle_map.pop_back(); })},
      {"mesh.opacity_map: entry 0 is 2, not below 2",
       mesh([](auto& m) { m.opacity.triangle_map[0] = 2; })},
      {"mesh.opacity_begin: 0 rows", mesh([](auto& m) { m.opacity.begin.clear(); })},
      {"mesh.opacity_begin: does not begin", mesh([](auto& m) { m.opacity.begin[0] = 1; })},
      {"mesh.opacity_begin: descends", mesh([](auto& m) { m.opacity.begin[1] = 6; })},
      {"mesh.opacity_begin: does not end", mesh([](auto& m) { m.opacity.opacity.pop_back(); })},
      {"mesh.opacity_begin: entry 0 is of a map of 3, not a power of 4",
       mesh([](auto& m) { m.opacity.begin[1] = 3; })},
      {"mesh.opacity_begin: entry 1 is of a map of 0", mesh([](auto& m) {
         m.opacity.begin = {0, 4, 4};
         m.opacity.opacity.pop_back();
       })},
      {"mesh.weight_begin: does not begin", mesh([](auto& m) { m.weight_begin[0] = 1; })},
      {"mesh.weight_begin: descends at entry 2", mesh([](auto& m) { m.weight_begin[1] = 3; })},
      {"mesh.weight_begin: does not end", mesh([](auto& m) { m.weight_begin[4] = 5; })},
      {"mesh.weight_begin: 4 rows, not 5", mesh([](auto& m) { m.weight_begin.pop_back(); })},
      {"mesh.weight_patch", mesh([](auto& m) { m.weight_patch[3] = 3; })},
      {"mesh.weight: 3 rows, not 4", mesh([](auto& m) { m.weight.pop_back(); })},
      {"mesh.weight", mesh([](auto& m) { m.weight[0] = kNan; })},
  });
}

TEST(TransferFile, RefusesAnImpossibleScene) {
  expect_refused({
      {"material.base_color:", [](auto& d) { d.materials[0].base_color[0] = kNan; }},
      {"material.emitted_luminance", [](auto& d) { d.materials[0].emitted_luminance[0] = -1; }},
      {"material.base_color_texture", [](auto& d) { d.materials[1].base_color_texture = 2; }},
      {"material.emissive_texture", [](auto& d) { d.materials[1].emissive_texture = 2; }},
      {"material.alpha_mode: entry 1 is 3",
       [](auto& d) { d.materials[1].alpha_mode = static_cast<AlphaMode>(3); }},
      {"material.alpha_cutoff", [](auto& d) { d.materials[0].alpha_cutoff = -1; }},
      {"material.base_alpha", [](auto& d) { d.materials[0].base_alpha = 1.5F; }},
      {"material.transmission", [](auto& d) { d.materials[1].transmission = kNan; }},
      {"texture.wrap_s: entry 1 is 3",
       [](auto& d) { d.textures[1].wrap_s = static_cast<TextureWrap>(3); }},
      {"texture.wrap_t", [](auto& d) { d.textures[0].wrap_t = static_cast<TextureWrap>(255); }},
      {"camera.position", [](auto& d) { d.cameras[0].position[0] = kNan; }},
      {"camera.right", [](auto& d) { d.cameras[0].right[0] = kNan; }},
      {"camera.up", [](auto& d) { d.cameras[0].up[0] = kNan; }},
      {"camera.backward", [](auto& d) { d.cameras[0].backward[0] = kNan; }},
      {"camera.vertical_fov", [](auto& d) { d.cameras[0].vertical_fov = 0; }},
      {"light.type: entry 0 is 3", [](auto& d) { d.lights[0].type = static_cast<LightType>(3); }},
      {"light.position", [](auto& d) { d.lights[0].position[0] = kNan; }},
      {"light.direction", [](auto& d) { d.lights[0].direction[0] = kNan; }},
      {"light.color", [](auto& d) { d.lights[0].color[0] = -1; }},
      {"light.intensity", [](auto& d) { d.lights[0].intensity = kInfinity; }},
      {"light.range", [](auto& d) { d.lights[0].range = -1; }},
      {"light.inner_cone_angle", [](auto& d) { d.lights[0].inner_cone_angle = kNan; }},
      {"light.outer_cone_angle", [](auto& d) { d.lights[0].outer_cone_angle = -1; }},
  });
}

LightProbes sample_probes() {
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

TEST(TransferFile, RefusesImpossibleProbes) {
  const auto probes = [](auto change) {
    return [change](TransferData& data) {
      data.probes = sample_probes();
      change(data.probes);
    };
  };
  expect_refused({
      {"probe.position", probes([](auto& p) { p.position[1][1] = kNan; })},
      {"probe.valid: 1 rows, not 2", probes([](auto& p) { p.valid.pop_back(); })},
      {"probe.valid", probes([](auto& p) { p.valid[0] = 2; })},
      {"probe.sky", probes([](auto& p) { p.sky[0][8] = kInfinity; })},
      {"probe.sky", probes([](auto& p) { p.sky.pop_back(); })},
      {"probe.entry_begin", probes([](auto& p) {
         p.entry_begin = {0, 4, 3};
       })},
      {"probe.entry_begin", probes([](auto& p) { p.entry_begin.pop_back(); })},
      {"probe.entry_patch: entry 1 is 3", probes([](auto& p) { p.entry_patch[1] = 3; })},
      {"probe.entry_weight", probes([](auto& p) { p.entry_weight[2][0] = kNan; })},
      {"probe.entry_weight", probes([](auto& p) { p.entry_weight.pop_back(); })},
      {"probe.sky_begin: 2 rows, not 3",
       probes([](auto& p) { p.sky_cells.entry_begin.pop_back(); })},
      {"probe.sky_begin: descends", probes([](auto& p) { p.sky_cells.entry_begin[1] = 3; })},
      {"probe.sky_cell: entry 1 is 146", probes([](auto& p) { p.sky_cells.entry_cell[1] = 146; })},
      {"probe.sky_weight: 1 rows, not 2",
       probes([](auto& p) { p.sky_cells.entry_weight.pop_back(); })},
      {"probe.sky_weight", probes([](auto& p) { p.sky_cells.entry_weight[0][3] = kNan; })},
      {"probe.grid", probes([](auto& p) {
         p.grid = {1, 1, 1};
       })},
      {"probe.grid", probes([](auto& p) {
         p.grid = {0, 2, 1};
       })},
      {"probe.grid", probes([](auto& p) {
         p.grid = {2, 2, 1};
       })},
  });
}

/// Of 2 x 1 texels, for the four vertices and two triangles of sample_data.
Lightmap sample_lightmap(const TransferData& data) {
  Lightmap map;
  map.width = 2;
  map.height = 1;
  map.texcoord.assign(data.mesh.position.size(), Float2{0.5F, 1});
  map.has_texels.assign(data.mesh.triangle.size(), 1);
  map.triangle = {0, kNone};
  map.weight = {{0.25F, 0.5F}, {0, 0}};
  return map;
}

TEST(TransferFile, KeepsALightmap) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  data.lightmap = sample_lightmap(data);
  save_transfer_file(folder / "file", data);
  const Lightmap read = load_transfer_file(folder / "file").lightmap;
  EXPECT_EQ(read.width, 2U);
  EXPECT_EQ(read.height, 1U);
  EXPECT_EQ(read.texcoord, data.lightmap.texcoord);
  EXPECT_EQ(read.has_texels, data.lightmap.has_texels);
  EXPECT_EQ(read.triangle, data.lightmap.triangle);
  EXPECT_EQ(read.weight, data.lightmap.weight);
}

TEST(TransferFile, RefusesImpossibleLightmaps) {
  const auto lightmap = [](auto change) {
    return [change](TransferData& data) {
      data.lightmap = sample_lightmap(data);
      change(data.lightmap);
    };
  };
  expect_refused({
      {"lightmap.triangle: 2 rows, not 6", lightmap([](auto& m) { m.height = 3; })},
      {"lightmap.triangle: 2 rows", lightmap([](auto& m) { m.width = m.height = 0xFFFFFFFF; })},
      {"lightmap.size: there are no texels", lightmap([](auto& m) { m.height = 0; })},
      {"lightmap.triangle: entry 1 is", lightmap([](auto& m) { m.triangle[1] = 1000; })},
      {"lightmap.weight", lightmap([](auto& m) { m.weight.pop_back(); })},
      {"lightmap.weight", lightmap([](auto& m) { m.weight[0][1] = kNan; })},
      {"lightmap.weight", lightmap([](auto& m) { m.weight[0][1] = 1.5F; })},
      {"lightmap.texcoord", lightmap([](auto& m) { m.texcoord.pop_back(); })},
      {"lightmap.texcoord", lightmap([](auto& m) { m.texcoord[1][0] = -0.1F; })},
      {"lightmap.has_texels", lightmap([](auto& m) { m.has_texels[0] = 2; })},
      {"lightmap.has_texels", lightmap([](auto& m) { m.has_texels.clear(); })},
  });
}

TEST(TransferFile, KeepsAndChecksTheCellsOfTheSky) {
  const auto cells = [](auto change) {
    return [change](TransferData& data) {
      data.sky_cells = {{0, 1, 1, 3}, {145, 0, 7}, {0.5F, 0.25F, 1}};
      change(data.sky_cells);
    };
  };
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  cells([](auto&) {})(data);
  save_transfer_file(folder / "file", data);
  const SkyCells read = load_transfer_file(folder / "file").sky_cells;
  EXPECT_EQ(read.entry_begin, data.sky_cells.entry_begin);
  EXPECT_EQ(read.entry_cell, data.sky_cells.entry_cell);
  EXPECT_EQ(read.entry_part, data.sky_cells.entry_part);
  expect_refused({
      {"sky.entry_begin: 3 rows, not 4", cells([](auto& c) { c.entry_begin.pop_back(); })},
      {"sky.entry_begin: descends", cells([](auto& c) { c.entry_begin[1] = 4; })},
      {"sky.entry_part", cells([](auto& c) { c.entry_part.pop_back(); })},
      {"sky.entry_part", cells([](auto& c) { c.entry_part[0] = 1.5F; })},
      {"sky.entry_part", cells([](auto& c) { c.entry_part[0] = kNan; })},
      {"sky.entry_cell: entry 0 is 146", cells([](auto& c) { c.entry_cell[0] = 146; })},
  });
}

TEST(TransferFile, RefusesImpossibleSurfaceHarmonics) {
  const auto harmonics = [](auto change) {
    return [change](TransferData& data) {
      SurfaceHarmonics& light = data.surface_harmonics;
      light.sky.assign(data.patches.size(), LinearHarmonics{1, 2, 3, 4});
      light.entry_begin = {0, 2, 2, 3};
      light.entry_patch = {1, 2, 0};
      light.entry_weight.assign(3, LinearHarmonics{1});
      light.sky_cells = {{0, 0, 1, 1}, {7}, {LinearHarmonics{1}}};
      change(light);
    };
  };
  expect_refused({
      {"surface_harmonics.sky: 2 rows, not 3", harmonics([](auto& h) { h.sky.pop_back(); })},
      {"surface_harmonics.sky", harmonics([](auto& h) { h.sky[1][3] = kNan; })},
      {"surface_harmonics.sky_begin: 3 rows, not 4",
       harmonics([](auto& h) { h.sky_cells.entry_begin.pop_back(); })},
      {"surface_harmonics.sky_cell: entry 0 is 200",
       harmonics([](auto& h) { h.sky_cells.entry_cell[0] = 200; })},
      {"surface_harmonics.sky_weight",
       harmonics([](auto& h) { h.sky_cells.entry_weight[0][0] = kInfinity; })},
      {"surface_harmonics.entry_begin", harmonics([](auto& h) { h.entry_begin.pop_back(); })},
      {"surface_harmonics.entry_begin", harmonics([](auto& h) { h.entry_begin[1] = 4; })},
      {"surface_harmonics.entry_weight: 3 rows",
       harmonics([](auto& h) { h.entry_patch.pop_back(); })},
      {"surface_harmonics.entry_patch: entry 2 is 3",
       harmonics([](auto& h) { h.entry_patch[2] = 3; })},
      {"surface_harmonics.entry_weight", harmonics([](auto& h) { h.entry_weight.clear(); })},
      {"surface_harmonics.entry_weight",
       harmonics([](auto& h) { h.entry_weight[0][0] = kInfinity; })},
  });
}

TEST(TransferFile, RefusesImpossibleLightFromEmitters) {
  const auto irradiance = [](const std::vector<Float3>& values) {
    return [values](TransferData& data) { data.emitted_irradiance = values; };
  };
  expect_refused({
      {"patch.emitted_irradiance: 2 rows, not 3", irradiance({{1, 1, 1}, {1, 1, 1}})},
      {"patch.emitted_irradiance: entry 1 is nan",
       irradiance({{1, 1, 1}, {1, kNan, 1}, {1, 1, 1}})},
  });
}

TEST(TransferFile, RefusesImpossibleFormFactors) {
  const auto begins = [](const std::vector<std::uint64_t>& values) {
    return [values](TransferData& data) { data.exchange.row_begin = SharedArray(values); };
  };
  const auto columns = [](const std::vector<std::uint32_t>& values) {
    return [values](TransferData& data) { data.exchange.column = SharedArray(values); };
  };
  const auto areas = [](const std::vector<float>& values) {
    return [values](TransferData& data) { data.exchange.exchange_area = SharedArray(values); };
  };
  expect_refused({
      {"form_factor.row_begin: 3 rows, not 4", begins({0, 2, 3})},
      {"form_factor.row_begin: does not begin with 0", begins({1, 2, 3, 3})},
      {"form_factor.row_begin: descends at entry 2", begins({0, 3, 2, 3})},
      {"form_factor.row_begin: descends", begins({0, ~std::uint64_t{0}, 3, 3})},
      {"form_factor.row_begin: does not end with 3", begins({0, 2, 3, 4})},
      {"form_factor.column: entry 2 is 3, not below 3", columns({1, 2, 3})},
      {"form_factor.column: entry 1 is 1, not at least 2", columns({1, 1, 2})},
      {"form_factor.column: entry 1 is 1, not at least 3", columns({2, 1, 2})},
      {"form_factor.column: entry 2 is 0, not at least 1", columns({1, 2, 0})},
      {"form_factor.exchange_area: 2 rows, not 3", areas({1, 1})},
      {"form_factor.exchange_area: entry 0 is 0", areas({0, 1, 1})},
      {"form_factor.exchange_area: entry 2 is inf", areas({1, 1, kInfinity})},
      {"form_factor.exchange_area: entry 1 is nan", areas({1, kNan, 1})},
  });
}

TEST(TransferFile, RefusesAnImpossibleRecord) {
  expect_refused({
      {"metadata error_bound", [](auto& d) { d.record.error_bound = std::nan(""); }},
      {"metadata error_mean", [](auto& d) { d.record.error_mean = -1; }},
      {"metadata tolerance", [](auto& d) { d.record.tolerance = HUGE_VAL; }},
      {"metadata settings: not valid JSON", [](auto& d) { d.settings_json = R"({"a":)"; }},
      {"metadata settings: not an object", [](auto& d) { d.settings_json = "[1, 2]"; }},
      {"metadata settings: the key", [](auto& d) { d.settings_json = R"({"a":1,"a":2})"; }},
      {"metadata report: JSON nested", [](auto& d) { d.report_json = std::string(100'000, '['); }},
  });
}

TEST(TransferFile, RefusesAnOperatorThatDoesNotFit) {
  const test::TemporaryFolder folder;
  TransferData data = sample_data();
  data.transfer = sample_operator(std::vector<float>(65, 1.0F), Precision::kF16);
  save_transfer_file(folder / "file", data);
  expect_error([&] { load_transfer_file(folder / "file"); },
               "tensor transfer.dense.tiles is F16[1, 3, 64, 64], not F16[any, 1, 64, 64]");

  save_transfer_file(folder / "file", sample_data());
  replace_in_file(folder / "file", "\"operator\":\"dense\"", "\"operator\":\"dance\"");
  expect_error([&] { load_transfer_file(folder / "file"); }, "kind");

  data.transfer = nullptr;
  expect_error([&] { save_transfer_file(folder / "file", data); }, "cannot hold this kind");
}

TEST(TransferFile, RefusesNamesThatDoNotFit) {
  const test::TemporaryFolder folder;
  for (const char* damaged : {R"(\"cameras\":{"front\"])", R"(\"cameras\":[1234567])",
                              R"(\"Cameras\":[\"front\"])", R"(\"cameras\":[\"fr\",\"\"])"}) {
    const std::string from = R"(\"cameras\":[\"front\"])";
    std::string to = damaged;
    to.resize(from.size(), ' ');
    save_transfer_file(folder / "file", sample_data());
    replace_in_file(folder / "file", from, to);
    EXPECT_THROW(load_transfer_file(folder / "file"), Error) << damaged;
  }
}

TEST(TransferFile, RefusesAMissingTensorAndAnotherType) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  replace_in_file(folder / "file", "\"mesh.position\"", "\"mesh.positiom\"");
  expect_error([&] { load_transfer_file(folder / "file"); }, "tensor mesh.position is missing");
  save_transfer_file(folder / "file", sample_data());
  std::string file = test::read_bytes(folder / "file");
  const std::size_t at = file.find("\"F32\"", file.find("\"patch.area\""));
  file[at + 1] = 'U';
  reseal(file);
  test::write_bytes(folder / "file", file);
  expect_error([&] { load_transfer_file(folder / "file"); }, "patch.area is U32[3], not F32[any]");
}

TEST(TransferFile, IgnoresATensorThatItDoesNotKnow) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const SafetensorsFile known(folder / "file");
  std::vector<TensorView> tensors;
  for (const auto& [name, info] : known.tensors()) {
    tensors.push_back(
        {name, info.type, info.shape, known.data().subspan(info.begin, info.end - info.begin)});
  }
  const std::vector<float> more{1, 2};
  tensors.push_back({"later.addition", TensorType::kF32, {2}, std::as_bytes(std::span(more))});
  write_safetensors(folder / "newer", lay_out_safetensors(tensors, known.metadata()));
  std::string file = test::read_bytes(folder / "newer");
  reseal(file);
  test::write_bytes(folder / "newer", file);
  expect_equal(load_transfer_file(folder / "newer"), sample_data());
}

TEST(TransferFile, LeavesTheTargetAloneWhenItCannotWrite) {
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const std::string before = test::read_bytes(folder / "file");
  {
    const test::FileSizeLimit limit(8192);
    expect_error([&] { save_transfer_file(folder / "file", sample_data(Precision::kF32)); },
                 "cannot write");
  }
  EXPECT_EQ(test::read_bytes(folder / "file"), before);
  EXPECT_EQ(folder.names(), Names{"file"});
  expect_error([&] { save_transfer_file(folder / "none/file", sample_data()); },
               "create the folder");
}

TEST(TransferFile, AFileMayBeReplacedWhileItIsInUse) {
  const test::TemporaryFolder folder;
  const TransferData data = sample_data(Precision::kF32);
  save_transfer_file(folder / "file", data);
  const TransferData loaded = load_transfer_file(folder / "file");
  save_transfer_file(folder / "file", sample_data(Precision::kF16));
  expect_equal(loaded, data);
}

// With the checksum made good after each mutation, nothing but the checks themselves protects.
TEST(TransferFile, SurvivesRandomMutationsUnderAGoodChecksum) {
  constexpr std::uint64_t kSeed = 20240608;
  constexpr int kCount = 4'000;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  const test::TemporaryFolder folder;
  save_transfer_file(folder / "file", sample_data());
  const std::string whole = test::read_bytes(folder / "file");
  const std::size_t prefix = prefix_size(whole);
  // The tiles come first and are not looked at: the tables behind them are what to aim at.
  const std::size_t tables = prefix + DenseOperator::kTile * DenseOperator::kTile * 2;
  int loaded = 0;
  for (int i = 0; i < kCount; ++i) {
    std::string file = whole;
    const std::size_t begin = i % 2 == 0 ? 0 : tables;
    const std::size_t end = i % 2 == 0 ? prefix : file.size();
    for (std::size_t edits = 1 + random() % 3; edits > 0; --edits) {
      const std::size_t at = begin + random() % (end - begin);
      file[at] = static_cast<char>(random() % 2 ? file[at] ^ (1 << random() % 8) : random());
    }
    reseal(file);
    test::write_bytes(folder / "file", file);
    try {
      use(load_transfer_file(folder / "file"));
      ++loaded;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(loaded, kCount / 50);
  EXPECT_LT(loaded, kCount * 9 / 10);
}

}  // namespace
}  // namespace rebounce

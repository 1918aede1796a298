// Data that no scene has, under a good checksum: each field is checked as it is read.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"
#include "tests/transfer/file/transfer_file_samples.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::test_impossible_data {
namespace {

using test::expect_error;
using test::sample_data;
using test::sample_lightmap;
using test::sample_probes;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

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

TEST(TransferFile, RefusesImpossibleRowsOfTexels) {
  const auto rows = [](auto change) {
    return [change](TransferData& data) {
      data.lightmap = test::sample_lightmap(data);
      data.texel_rows = test::sample_texel_rows();
      change(data);
    };
  };
  expect_refused({
      {"texel_receiver.set: entry 1 is empty", rows([](auto& d) {
         d.texel_rows.set[1] = {2, 2};
       })},
      {"texel_receiver.texel: entry 5 is 2, not below 2",
       rows([](auto& d) { d.texel_rows.receiver[5] = 2; })},
      {"texel_receiver.texel: entry 5 is 1, not a texel that shows a triangle",
       rows([](auto& d) { d.texel_rows.receiver[5] = 1; })},
      {"texel_receiver.texel: entry 5 is 0, not below 0", rows([](auto& d) { d.lightmap = {}; })},
  });
}

TEST(TransferFile, RefusesImpossibleRowsOfReceivers) {
  const auto rows = [](auto change) {
    return [change](TransferData& data) {
      data.receiver_rows = test::sample_receiver_rows();
      change(data.receiver_rows);
    };
  };
  expect_refused({
      {"receiver.patch: 2 rows, not 3", rows([](auto& r) { r.patch.pop_back(); })},
      {"receiver.patch: entry 1 is 3, not below 3", rows([](auto& r) { r.patch[1] = 3; })},
      {"receiver.patch: entry 1 is 2, which an earlier entry is too",
       rows([](auto& r) { r.patch[1] = 2; })},
      {"receiver.set: entry 1 is empty", rows([](auto& r) {
         r.set[1] = {2, 2};
       })},
      {"receiver.set: entry 0", rows([](auto& r) {
         r.set[0] = {1, 4};
       })},
      {"receiver.entry_set: entry 2 is 2, not below 2", rows([](auto& r) { r.entry_set[2] = 2; })},
      {"receiver.scale: entry 0", rows([](auto& r) { r.scale[0] = kNan; })},
      {"receiver.scale: entry 1", rows([](auto& r) { r.scale[1] = -1; })},
      {"receiver.scale: 3 rows, not 4", rows([](auto& r) { r.scale.pop_back(); })},
      {"receiver.vertex: 127 rows, not 128", rows([](auto& r) { r.receiver.pop_back(); })},
      {"receiver.vertex: entry 0 is 4, not below 4", rows([](auto& r) { r.receiver[0] = 4; })},
      {"receiver.vertex: entry 127 is 3, which an earlier entry is too",
       rows([](auto& r) { r.receiver[127] = 3; })},
      {"receiver.value", rows([](auto& r) { r.value.pop_back(); })},
      {"receiver.group_begin: does not begin", rows([](auto& r) { r.group_begin[0] = 4; })},
      {"receiver.group_begin: descends", rows([](auto& r) { r.group_begin[1] = 8; })},
      {"receiver.group_begin: does not end", rows([](auto& r) {
         r.group_begin = {0, 0, 0};
       })},
      {"receiver.group_begin: entry 1 is 3, not a multiple of 4",
       rows([](auto& r) { r.group_begin[1] = 3; })},
      {"receiver.group_begin: entry 1 is 1028, not a multiple of 4, at most 1024",
       rows([](auto& r) {
         r.group_begin = {0, 1028, 1028};
         r.entry_set.assign(1028, 0);
         r.scale.assign(1028, 1);
         r.value.assign(1028 * std::size_t{64}, 0);
       })},
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

TEST(TransferFile, RefusesImpossibleCellsOfTheSky) {
  const auto cells = [](auto change) {
    return [change](TransferData& data) {
      data.sky_cells = test::sample_sky_cells();
      change(data.sky_cells);
    };
  };
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
      data.surface_harmonics = test::sample_surface_harmonics();
      change(data.surface_harmonics);
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

}  // namespace
}  // namespace rebounce::test_impossible_data

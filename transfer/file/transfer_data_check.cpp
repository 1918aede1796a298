#include "transfer/file/transfer_data_check.h"

#include <concepts>
#include <limits>
#include <optional>
#include <vector>

#include "rebounce/error.h"
#include "transfer/base/shortest_decimal.h"
#include "transfer/data/opacity_maps.h"
#include "transfer/file/transfer_file_format.h"

namespace rebounce {
namespace {

// Allowed ranges of numbers. NaN is in none of them.
constexpr float kLargest = std::numeric_limits<float>::max();
constexpr float kPi = 3.14159265F;

struct Range {
  const char* text;
  bool (*holds)(float);
};
constexpr Range kFinite{"finite", [](float x) { return x >= -kLargest && x <= kLargest; }};
constexpr Range kPositive{"finite and > 0", [](float x) { return x > 0 && x <= kLargest; }};
constexpr Range kNotNegative{"finite and >= 0", [](float x) { return x >= 0 && x <= kLargest; }};
constexpr Range kFraction{"in [0, 1]", [](float x) { return x >= 0 && x <= 1; }};
constexpr Range kReflectance{"in [0, 1)", [](float x) { return x >= 0 && x < 1; }};
constexpr Range kFieldOfView{"in (0, pi)", [](float x) { return x > 0 && x < kPi; }};

class Checker {
 public:
  Checker(const TransferData& data, const std::string& file) : data_(data), file_(file) {}

  void check() const {
    check_sizes();
    check_patches();
    check_mesh();
    check_opacity();
    check_weights();
    check_materials();
    check_cameras();
    check_lights();
    check_sky_cells();
    check_probes();
    check_lightmap();
    check_surface_harmonics();
    check_receiver_rows(data_.receiver_rows, tensor::kVertexRows, data_.mesh.position.size());
    check_texel_rows();
    check_exchange();
  }

 private:
  [[noreturn]] void refuse(const std::string& name, const std::string& reason) const {
    throw Error(file_ + ": tensor " + name + ": " + reason + "; make the file again");
  }

  [[noreturn]] void refuse_entry(const std::string& name, std::size_t entry,
                                 const std::string& value, const std::string& wanted) const {
    refuse(name, "entry " + std::to_string(entry) + " is " + value + ", not " + wanted);
  }

  void rows(const char* name, std::size_t rows, std::size_t wanted) const {
    if (rows != wanted) {
      refuse(name, std::to_string(rows) + " rows, not " + std::to_string(wanted));
    }
  }

  void number(const char* name, std::size_t entry, float value, Range range) const {
    if (!range.holds(value)) refuse_entry(name, entry, shortest_decimal(value), range.text);
  }

  template <std::size_t N>
  void number(const char* name, std::size_t entry, const std::array<float, N>& value,
              Range range) const {
    for (const float component : value) number(name, entry, component, range);
  }

  template <typename Values>
  void numbers(const char* name, const Values& values, Range range) const {
    for (std::size_t i = 0; i < values.size(); ++i) number(name, i, values[i], range);
  }

  template <typename Item, typename T>
  void numbers(const char* name, const std::vector<Item>& items, T Item::*member,
               Range range) const {
    for (std::size_t i = 0; i < items.size(); ++i) number(name, i, items[i].*member, range);
  }

  void index(const char* name, std::size_t entry, std::uint32_t value, std::size_t count) const {
    if (value >= count) {
      refuse_entry(name, entry, std::to_string(value), "below " + std::to_string(count));
    }
  }

  void index_or_none(const char* name, std::size_t entry, std::uint32_t value,
                     std::size_t count) const {
    if (value != kNone) index(name, entry, value, count);
  }

  /// Checks offsets: they start at 0, never descend, and end at `end`.
  template <std::unsigned_integral T>
  void begins(const char* name, std::span<const T> begin, std::size_t end) const {
    if (begin.front() != 0) refuse(name, "does not begin with 0");
    for (std::size_t i = 1; i < begin.size(); ++i) {
      if (begin[i] < begin[i - 1]) refuse(name, "descends at entry " + std::to_string(i));
    }
    if (begin.back() != end) refuse(name, "does not end with " + std::to_string(end));
  }

  void check_sizes() const {
    const std::size_t n = data_.patches.size();
    if (n == 0) refuse("patch.area", "there are no patches");
    if (n >= kNone) refuse("patch.area", "there are more patches than indices");
    visit_tensors_of_patches(
        data_.patches, [&](const char* name, const auto& values) { rows(name, values.size(), n); });
    if (const std::size_t count = data_.emitted_irradiance.size(); count > 0) {
      rows(tensor::kEmittedIrradiance, count, n);
    }

    const DisplayMesh& mesh = data_.mesh;
    const std::size_t vertices = mesh.position.size();
    const std::size_t triangles = mesh.triangle.size();
    rows("mesh.normal", mesh.normal.size(), vertices);
    rows("mesh.base_color_texcoord", mesh.base_color_texcoord.size(), vertices);
    rows("mesh.emissive_texcoord", mesh.emissive_texcoord.size(), vertices);
    rows("mesh.vertex_color", mesh.vertex_color.size(), vertices);
    rows("mesh.weight_begin", mesh.weight_begin.size(), vertices + 1);
    rows("mesh.weight", mesh.weight.size(), mesh.weight_patch.size());
    rows("mesh.triangle_patch", mesh.triangle_patch.size(), triangles);
    rows("mesh.triangle_material", mesh.triangle_material.size(), triangles);
    if (mesh.surface_count() > triangles) {
      refuse("mesh.back_triangle", "more rows than there are triangles");
    }

    if (!data_.exchange.empty()) rows(tensor::kRowBegin, data_.exchange.row_begin.size(), n + 1);
    rows(tensor::kExchangeArea, data_.exchange.exchange_area.size(), data_.exchange.column.size());
  }

  void check_patches() const {
    const PatchTable& patches = data_.patches;
    numbers("patch.area", patches.area, kPositive);
    numbers("patch.centroid", patches.centroid, kFinite);
    numbers("patch.normal", patches.normal, kFinite);
    numbers("patch.reflectance", patches.reflectance, kReflectance);
    numbers("patch.emitted_exitance", patches.emitted_exitance, kNotNegative);
    numbers("patch.sky_visibility", patches.sky_visibility, kFraction);
    numbers("patch.absorbed", patches.absorbed, kFraction);
    numbers(tensor::kEmittedIrradiance, data_.emitted_irradiance, kFinite);
  }

  void check_mesh() const {
    const DisplayMesh& mesh = data_.mesh;
    numbers("mesh.position", mesh.position, kFinite);
    numbers("mesh.normal", mesh.normal, kFinite);
    numbers("mesh.base_color_texcoord", mesh.base_color_texcoord, kFinite);
    numbers("mesh.emissive_texcoord", mesh.emissive_texcoord, kFinite);
    numbers("mesh.vertex_color", mesh.vertex_color, kNotNegative);
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
      for (const std::uint32_t vertex : mesh.triangle[t]) {
        index("mesh.triangle", t, vertex, mesh.position.size());
      }
      index_or_none("mesh.triangle_patch", t, mesh.triangle_patch[t], data_.patches.size());
      index("mesh.triangle_material", t, mesh.triangle_material[t], data_.materials.size());
    }
    check_back_triangles();
  }

  void check_back_triangles() const {
    const DisplayMesh& mesh = data_.mesh;
    for (std::size_t t = 0; t < mesh.surface_count(); ++t) {
      const std::uint32_t back = mesh.back_triangle[t];
      index_or_none("mesh.back_triangle", t, back, mesh.triangle.size());
      if (back < mesh.surface_count()) {
        refuse_entry("mesh.back_triangle", t, std::to_string(back), "after the surface");
      }
    }
  }

  void check_opacity() const {
    const OpacityMaps& maps = data_.mesh.opacity;
    if (maps.empty()) return;
    rows(tensor::kOpacityMap, maps.triangle_map.size(), data_.mesh.triangle.size());
    if (maps.begin.empty()) refuse("mesh.opacity_begin", "0 rows, not at least 1");
    begins<std::uint32_t>("mesh.opacity_begin", maps.begin, maps.opacity.size());
    for (std::size_t k = 0; k < maps.map_count(); ++k) {
      const std::uint32_t size = maps.begin[k + 1] - maps.begin[k];
      if (is_opacity_map_size(size)) continue;
      refuse_entry("mesh.opacity_begin", k, "of a map of " + std::to_string(size),
                   "a power of 4 up to 1024");
    }
    for (std::size_t t = 0; t < maps.triangle_map.size(); ++t) {
      index_or_none(tensor::kOpacityMap, t, maps.triangle_map[t], maps.map_count());
    }
  }

  void check_weights() const {
    const DisplayMesh& mesh = data_.mesh;
    begins<std::uint32_t>("mesh.weight_begin", mesh.weight_begin, mesh.weight.size());
    numbers("mesh.weight", mesh.weight, kFinite);
    for (std::size_t i = 0; i < mesh.weight_patch.size(); ++i) {
      index("mesh.weight_patch", i, mesh.weight_patch[i], data_.patches.size());
    }
  }

  void check_materials() const {
    const std::vector<Material>& materials = data_.materials;
    const std::size_t textures = data_.textures.size();
    numbers("material.base_color", materials, &Material::base_color, kNotNegative);
    numbers("material.emitted_luminance", materials, &Material::emitted_luminance, kNotNegative);
    numbers("material.alpha_cutoff", materials, &Material::alpha_cutoff, kNotNegative);
    numbers("material.base_alpha", materials, &Material::base_alpha, kFraction);
    numbers("material.transmission", materials, &Material::transmission, kFraction);
    for (std::size_t i = 0; i < materials.size(); ++i) {
      const Material& material = materials[i];
      index_or_none("material.base_color_texture", i, material.base_color_texture, textures);
      index_or_none("material.emissive_texture", i, material.emissive_texture, textures);
    }
  }

  void check_cameras() const {
    const std::vector<Camera>& cameras = data_.cameras;
    numbers("camera.position", cameras, &Camera::position, kFinite);
    numbers("camera.right", cameras, &Camera::right, kFinite);
    numbers("camera.up", cameras, &Camera::up, kFinite);
    numbers("camera.backward", cameras, &Camera::backward, kFinite);
    numbers("camera.vertical_fov", cameras, &Camera::vertical_fov, kFieldOfView);
  }

  void check_lights() const {
    const std::vector<Light>& lights = data_.lights;
    numbers("light.position", lights, &Light::position, kFinite);
    numbers("light.direction", lights, &Light::direction, kFinite);
    numbers("light.color", lights, &Light::color, kNotNegative);
    numbers("light.intensity", lights, &Light::intensity, kNotNegative);
    numbers("light.range", lights, &Light::range, kNotNegative);
    numbers("light.inner_cone_angle", lights, &Light::inner_cone_angle, kNotNegative);
    numbers("light.outer_cone_angle", lights, &Light::outer_cone_angle, kNotNegative);
  }

  void check_probes() const {
    const LightProbes& probes = data_.probes;
    const std::size_t count = probes.size(), entries = probes.entry_patch.size();
    rows("probe.valid", probes.valid.size(), count);
    rows("probe.sky", probes.sky.size(), count);
    rows("probe.entry_begin", probes.entry_begin.size(), count + 1);
    rows("probe.entry_weight", probes.entry_weight.size(), entries);
    begins<std::uint32_t>("probe.entry_begin", probes.entry_begin, entries);
    numbers("probe.position", probes.position, kFinite);
    numbers("probe.sky", probes.sky, kFinite);
    numbers("probe.entry_weight", probes.entry_weight, kFinite);
    for (std::size_t i = 0; i < entries; ++i) {
      index("probe.entry_patch", i, probes.entry_patch[i], data_.patches.size());
    }
    for (std::size_t i = 0; i < count; ++i) index("probe.valid", i, probes.valid[i], 2);
    check_sky_harmonics({tensor::kProbeSkyBegin, "probe.sky_cell", "probe.sky_weight"}, count,
                        probes.sky_cells);
    check_probe_grid();
  }

  struct SkyTensors {
    const char *begin, *cell, *weight;
  };

  template <typename Weight>
  void check_sky_harmonics(const SkyTensors& name, std::size_t places,
                           const SkyHarmonics<Weight>& sky) const {
    if (sky.empty()) return;
    rows(name.begin, sky.entry_begin.size(), places + 1);
    rows(name.weight, sky.entry_weight.size(), sky.entry_cell.size());
    begins<std::uint32_t>(name.begin, sky.entry_begin, sky.entry_cell.size());
    numbers(name.weight, sky.entry_weight, kFinite);
    for (std::size_t i = 0; i < sky.entry_cell.size(); ++i) {
      index(name.cell, i, sky.entry_cell[i], kSkyCellCount);
    }
  }

  void check_probe_grid() const {
    const auto [x, y, z] = data_.probes.grid;
    if (x == 0 && y == 0 && z == 0) return;
    std::size_t rest = data_.probes.size();
    for (const std::uint32_t side : {x, y, z}) {
      if (side == 0 || rest % side != 0)
        refuse(tensor::kProbeGrid, "does not fit the number of probes");
      rest /= side;
    }
    if (rest != 1) refuse(tensor::kProbeGrid, "does not fit the number of probes");
  }

  void check_sky_cells() const {
    const SkyCells& cells = data_.sky_cells;
    if (cells.empty()) return;
    rows(tensor::kSkyBegin, cells.entry_begin.size(), data_.patches.size() + 1);
    rows("sky.entry_part", cells.entry_part.size(), cells.entry_cell.size());
    begins<std::uint32_t>(tensor::kSkyBegin, cells.entry_begin, cells.entry_cell.size());
    numbers("sky.entry_part", cells.entry_part, kFraction);
    for (std::size_t i = 0; i < cells.entry_cell.size(); ++i) {
      index("sky.entry_cell", i, cells.entry_cell[i], kSkyCellCount);
    }
  }

  void check_lightmap() const {
    const Lightmap& map = data_.lightmap;
    if (map.empty()) return;
    const std::size_t texels = std::size_t{map.width} * map.height;
    rows("lightmap.texcoord", map.texcoord.size(), data_.mesh.position.size());
    rows("lightmap.has_texels", map.has_texels.size(), data_.mesh.triangle.size());
    rows("lightmap.triangle", map.triangle.size(), texels);
    rows("lightmap.weight", map.weight.size(), texels);
    numbers("lightmap.texcoord", map.texcoord, kFraction);
    numbers("lightmap.weight", map.weight, kFraction);
    for (std::size_t t = 0; t < map.has_texels.size(); ++t) {
      index("lightmap.has_texels", t, map.has_texels[t], 2);
    }
    for (std::size_t k = 0; k < texels; ++k) {
      index_or_none("lightmap.triangle", k, map.triangle[k], data_.mesh.triangle.size());
    }
  }

  void check_surface_harmonics() const {
    const SurfaceHarmonics& light = data_.surface_harmonics;
    if (light.empty()) return;
    const std::size_t n = data_.patches.size(), entries = light.entry_patch.size();
    rows(tensor::kSurfaceSky, light.sky.size(), n);
    rows("surface_harmonics.entry_begin", light.entry_begin.size(), n + 1);
    rows("surface_harmonics.entry_weight", light.entry_weight.size(), entries);
    begins<std::uint32_t>("surface_harmonics.entry_begin", light.entry_begin, entries);
    numbers(tensor::kSurfaceSky, light.sky, kFinite);
    numbers("surface_harmonics.entry_weight", light.entry_weight, kFinite);
    for (std::size_t i = 0; i < entries; ++i) {
      index("surface_harmonics.entry_patch", i, light.entry_patch[i], n);
    }
    check_sky_harmonics(
        {tensor::kSurfaceSkyBegin, "surface_harmonics.sky_cell", "surface_harmonics.sky_weight"}, n,
        light.sky_cells);
  }

  void check_receiver_rows(const ReceiverRows& rows_of, const tensor::RowNames& names,
                           std::size_t receiver_count) const {
    if (rows_of.empty()) return;
    const std::size_t n = data_.patches.size(), entries = rows_of.entry_set.size();
    rows(names.patch, rows_of.patch.size(), n);
    rows(names.scale, rows_of.scale.size(), entries);
    rows(names.receiver, rows_of.receiver.size(), ReceiverRows::kGroup * rows_of.group_count());
    rows(names.value, rows_of.value.size(), ReceiverRows::kGroup * entries);
    numbers(names.scale, rows_of.scale, kNotNegative);
    each_once(names.patch, rows_of.patch, n);
    each_once(names.receiver, rows_of.receiver, receiver_count, kNone);
    for (std::size_t k = 0; k < rows_of.set.size(); ++k) {
      const auto [begin, end] = rows_of.set[k];
      if (begin >= end || end > n) refuse(names.set, "entry " + std::to_string(k) + " is empty");
    }
    for (std::size_t e = 0; e < entries; ++e) {
      index(names.entry_set, e, rows_of.entry_set[e], rows_of.set.size());
    }
    begins<std::uint32_t>(names.begin, rows_of.group_begin, entries);
    for (std::size_t g = 0; g < rows_of.group_count(); ++g) {
      const std::uint32_t sets = rows_of.group_begin[g + 1] - rows_of.group_begin[g];
      if (sets % ReceiverRows::kSetStep == 0 && sets <= ReceiverRows::kMostSets) continue;
      refuse_entry(names.begin, g + 1, std::to_string(rows_of.group_begin[g + 1]),
                   "a multiple of 4, at most 1024, after the one before it");
    }
  }

  /// Texels that show nothing have no rows.
  void check_texel_rows() const {
    if (data_.texel_rows.empty()) return;
    const std::vector<std::uint32_t>& shown = data_.lightmap.triangle;
    check_receiver_rows(data_.texel_rows, tensor::kTexelRows, shown.size());
    for (std::size_t k = 0; k < data_.texel_rows.receiver.size(); ++k) {
      const std::uint32_t texel = data_.texel_rows.receiver[k];
      if (texel == kNone || shown[texel] != kNone) continue;
      refuse_entry(tensor::kTexelRows.receiver, k, std::to_string(texel),
                   "a texel that shows a triangle");
    }
  }

  /// Indices below `count`, none twice, or `allowed`.
  void each_once(const char* name, std::span<const std::uint32_t> values, std::size_t count,
                 std::optional<std::uint32_t> allowed = {}) const {
    std::vector<bool> there(count, false);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] == allowed) continue;
      index(name, i, values[i], count);
      if (there[values[i]]) {
        refuse(name, "entry " + std::to_string(i) + " is " + std::to_string(values[i]) +
                         ", which an earlier entry is too");
      }
      there[values[i]] = true;
    }
  }

  void check_exchange() const {
    const ExchangeMatrix& exchange = data_.exchange;
    if (exchange.empty()) return;
    begins(tensor::kRowBegin, exchange.row_begin.span(), exchange.column.size());
    for (std::size_t row = 0; row < data_.patches.size(); ++row) {
      std::size_t least = row;  // not below the diagonal
      for (std::size_t i = exchange.row_begin[row]; i < exchange.row_begin[row + 1]; ++i) {
        index(tensor::kColumn, i, exchange.column[i], data_.patches.size());
        if (exchange.column[i] < least) {
          refuse_entry(tensor::kColumn, i, std::to_string(exchange.column[i]),
                       "at least " + std::to_string(least));
        }
        least = exchange.column[i] + std::size_t{1};
      }
    }
    numbers(tensor::kExchangeArea, exchange.exchange_area, kPositive);
  }

  const TransferData& data_;
  const std::string& file_;
};

}  // namespace

void check_transfer_data(const TransferData& data, const std::string& file) {
  Checker(data, file).check();
}

}  // namespace rebounce

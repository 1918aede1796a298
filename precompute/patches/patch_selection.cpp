#include "precompute/patches/patch_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <utility>

#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr std::string_view kBox = "box:", kMesh = "mesh:", kMaterial = "material:";

// The number of names that a message about a missing name lists.
constexpr std::size_t kListedNames = 8;

/// The text in quotes and on one line.
std::string in_quotes(std::string_view text) {
  return nlohmann::json(std::string(text))
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// The number of letters to add, remove or change to turn one text into the other (V. I.
/// Levenshtein, 1966), ignoring case.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// The `names` that are most similar to `name`, the most similar first.
std::vector<std::string> nearest(std::string_view name, const std::set<std::string>& names) {
  std::vector<std::pair<std::size_t, std::string>> all;
  for (const std::string& other : names) {
    if (!other.empty()) all.emplace_back(edit_distance(name, other), in_quotes(other));
  }
  std::ranges::sort(all);
  all.resize(std::min(all.size(), kListedNames));
  std::vector<std::string> result;
  for (auto& [distance, other] : all) result.push_back(std::move(other));
  return result;
}

std::set<std::string> names_in(const Scene& scene, bool of_meshes, bool of_materials) {
  std::set<std::string> names;
  if (of_meshes) {
    for (const PlacedMesh& mesh : scene.placed_meshes)
      names.insert({mesh.mesh_name, mesh.node_name});
  }
  if (of_materials) {
    for (const Material& material : scene.materials) names.insert(material.name);
  }
  return names;
}

}  // namespace

std::vector<std::string> split_selection(std::string_view list) {
  std::vector<std::string> entries;
  int numbers_left = 0;  // of a box
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    const std::string_view part = list.substr(begin, end - begin);
    if (numbers_left > 0) {
      entries.back().append(",").append(part);
      --numbers_left;
    } else {
      entries.emplace_back(part);
      numbers_left = part.starts_with(kBox) ? 5 : 0;
    }
    begin = end + 1;
  }
  return entries;
}

PatchSelection::PatchSelection(std::span<const std::string> entries, const Scene& scene,
                               std::string list)
    : list_(std::move(list)) {
  for (const std::string& entry : entries) add(entry, scene);
  std::ranges::sort(meshes_);
  std::ranges::sort(materials_);
}

void PatchSelection::add(const std::string& entry, const Scene& scene) {
  const std::string_view text = entry;
  if (text.starts_with(kBox)) {
    add_box(entry);
  } else if (text.starts_with(kMesh)) {
    add_name(text.substr(kMesh.size()), true, false, scene);
  } else if (text.starts_with(kMaterial)) {
    add_name(text.substr(kMaterial.size()), false, true, scene);
  } else {
    add_name(text, true, true, scene);
  }
}

void PatchSelection::add_box(const std::string& entry) {
  std::array<float, 6> corner{};
  const char* at = entry.data() + kBox.size();
  const char* const end = entry.data() + entry.size();
  bool good = true;
  for (std::size_t k = 0; k < corner.size() && good; ++k) {
    const auto [next, error] = std::from_chars(at, end, corner[k]);
    const bool last = k + 1 == corner.size();
    good = error == std::errc() && std::isfinite(corner[k]) &&
           (last ? next == end : next != end && *next == ',');
    at = good && !last ? next + 1 : next;
  }
  if (!good) {
    throw Error(
        fmt::format("{}: {} is not a box; write box: and two corners, X0,Y0,Z0,X1,Y1,Z1, in "
                    "metres",
                    list_, in_quotes(entry)));
  }
  Box& box = boxes_.emplace_back();
  for (std::size_t k = 0; k < 3; ++k) {
    box.low[k] = std::min(corner[k], corner[k + 3]);
    box.high[k] = std::max(corner[k], corner[k + 3]);
  }
}

void PatchSelection::add_name(std::string_view name, bool of_meshes, bool of_materials,
                              const Scene& scene) {
  const std::size_t before = meshes_.size() + materials_.size();
  for (std::uint32_t k = 0; of_meshes && k < scene.placed_meshes.size(); ++k) {
    const PlacedMesh& mesh = scene.placed_meshes[k];
    if (!name.empty() && (mesh.mesh_name == name || mesh.node_name == name)) meshes_.push_back(k);
  }
  for (std::uint32_t k = 0; of_materials && k < scene.materials.size(); ++k) {
    if (!name.empty() && scene.materials[k].name == name) materials_.push_back(k);
  }
  if (meshes_.size() + materials_.size() > before) return;
  const auto others = nearest(name, names_in(scene, of_meshes, of_materials));
  const char* const kind = !of_meshes ? "material" : of_materials ? "mesh or material" : "mesh";
  const std::string advice = others.empty() ? "it has none with a name: give box: and two corners"
                                            : fmt::format("there are {}", fmt::join(others, ", "));
  throw Error(fmt::format("{}: the scene has no {} {}; {}", list_, kind, in_quotes(name), advice));
}

std::vector<std::uint8_t> PatchSelection::patches(const PatchModel& model) const {
  const DisplayMesh& mesh = model.mesh;
  std::vector<std::uint8_t> selected(model.patches.size(), 0);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    const std::uint32_t patch = mesh.triangle_patch[t];
    if (patch == kNone) continue;
    const bool named =
        std::ranges::binary_search(materials_, mesh.triangle_material[t]) ||
        (!meshes_.empty() && std::ranges::binary_search(meshes_, model.triangle_mesh[t]));
    if (named) selected[patch] = 1;
  }
  for (const Box& box : boxes_) {
    for (std::size_t i = 0; i < selected.size(); ++i) {
      const Float3& p = model.patches.centroid[i];
      bool inside = true;
      for (int k = 0; k < 3; ++k) inside = inside && box.low[k] <= p[k] && p[k] <= box.high[k];
      if (inside) selected[i] = 1;
    }
  }
  if (std::ranges::find(selected, 1) == selected.end()) {
    throw Error(list_ + ": the named surfaces have no patches; name more surfaces or a larger box");
  }
  return selected;
}

PatchRoles choose_roles(const PatchModel& model, const PatchSelection& receivers,
                        const PatchSelection& sources) {
  PatchRoles roles;
  roles.role.assign(model.patches.size(), 0);
  const auto give = [&](const PatchSelection& selection, std::uint8_t bit) {
    const std::vector<std::uint8_t> selected = selection.empty()
                                                   ? std::vector<std::uint8_t>(roles.role.size(), 1)
                                                   : selection.patches(model);
    for (std::size_t i = 0; i < selected.size(); ++i) {
      if (selected[i] != 0) roles.role[i] = static_cast<std::uint8_t>(roles.role[i] | bit);
    }
  };
  give(receivers, PatchRoles::kReceiver);
  give(sources, PatchRoles::kSource);
  for (std::size_t i = 0; i < roles.role.size(); ++i) {
    if (model.patches.emitted_exitance[i] == Float3{0, 0, 0}) continue;
    roles.role[i] = static_cast<std::uint8_t>(roles.role[i] | PatchRoles::kSource);
  }
  const bool all_both =
      std::ranges::all_of(roles.role, [](std::uint8_t r) { return r == PatchRoles::kBoth; });
  if (all_both) roles.role.clear();
  return roles;
}

double wanted_part(const PatchRoles& roles, std::size_t patch_count) {
  if (roles.all_are_both()) return 1;
  const auto n = static_cast<double>(patch_count);
  const double receivers = static_cast<double>(roles.count(PatchRoles::kReceiver, patch_count)) / n;
  const double sources = static_cast<double>(roles.count(PatchRoles::kSource, patch_count)) / n;
  const double both = static_cast<double>(std::ranges::count(roles.role, PatchRoles::kBoth)) / n;
  // Pairs whose light is wanted both ways count once.
  return 2 * receivers * sources - both * both;
}

}  // namespace rebounce

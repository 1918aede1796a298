#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "precompute/import/scene.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/scene_data.h"

namespace rebounce {

/// Splits a comma-separated list of entries of PatchSelection; the commas inside boxes do not
/// separate. Names with a comma cannot be in such a list.
std::vector<std::string> split_selection(std::string_view list);

/// Some of a scene's surface by name or place. Each entry is one of
///   NAME                     meshes, nodes that place one, and materials of that name
///   mesh:NAME                meshes, and nodes that place one
///   material:NAME            materials
///   box:X0,Y0,Z0,X1,Y1,Z1    patches with their centroid between two corners, metres in the world
class PatchSelection {
 public:
  /// `list` is the name of the list in messages. Throws Error if an entry is malformed or the scene
  /// has nothing of that name; the message then lists the most similar names.
  PatchSelection(std::span<const std::string> entries, const Scene& scene, std::string list);
  PatchSelection() = default;

  bool empty() const { return boxes_.empty() && meshes_.empty() && materials_.empty(); }

  /// [n] 1 for patches with a triangle of a named surface or with their centroid in a box, 0 for
  /// others. `model` is that of the scene. Throws Error if there are none.
  std::vector<std::uint8_t> patches(const PatchModel& model) const;

 private:
  struct Box {
    Float3 low, high;
  };

  void add(const std::string& entry, const Scene& scene);
  void add_box(const std::string& entry);
  void add_name(std::string_view name, bool of_meshes, bool of_materials, const Scene& scene);

  std::string list_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> meshes_, materials_;  ///< indices in the scene
};

/// The roles of the patches of a model with these receivers and sources; an empty selection means
/// all patches. Patches that emit are always sources. Throws Error as PatchSelection::patches does.
PatchRoles choose_roles(const PatchModel& model, const PatchSelection& receivers,
                        const PatchSelection& sources);

/// The fraction of all pairs of patches between which light is wanted in either direction: the
/// fraction of an operator that is compressed and stored.
double wanted_part(const PatchRoles& roles, std::size_t patch_count);

}  // namespace rebounce

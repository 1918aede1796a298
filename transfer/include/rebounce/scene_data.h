#pragma once

// What a transfer file says of its scene: patches, display mesh, materials, cameras, lights, and
// the maps that take light to where it is shown.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "rebounce/lights.h"
#include "rebounce/types.h"

namespace rebounce {

/// A perspective camera placed in the world. `right`, `up` and `backward` are orthonormal.
struct Camera {
  std::string name;
  Float3 position{0, 0, 0};
  Float3 right{1, 0, 0};
  Float3 up{0, 1, 0};
  Float3 backward{0, 0, 1};   ///< the camera looks along -backward, as in glTF
  float vertical_fov = 0.8F;  ///< radians
};

enum class TextureWrap : std::uint8_t { kRepeat, kClampToEdge, kMirroredRepeat };

/// An image in its encoded form (PNG or JPEG bytes), as the asset carries it where it can be.
struct Texture {
  std::vector<std::uint8_t> encoded;
  TextureWrap wrap_s = TextureWrap::kRepeat;
  TextureWrap wrap_t = TextureWrap::kRepeat;
};

/// What a material's opacity means, as glTF's alphaMode.
enum class AlphaMode : std::uint8_t {
  kOpaque,  ///< the opacity is not looked at
  kMask,    ///< there where the opacity is at least the cutoff, a hole elsewhere
  kBlend,   ///< lets 1 - opacity through
};

struct Material {
  std::string name;
  Float3 base_color{1, 1, 1};         ///< linear; multiplies texture and vertex colour
  Float3 emitted_luminance{0, 0, 0};  ///< cd/m² (nit): emissiveFactor x emissiveStrength
  std::uint32_t base_color_texture = kNone;
  std::uint32_t emissive_texture = kNone;
  bool double_sided = false;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5F;  ///< >= 0; used by kMask
  float base_alpha = 1;       ///< [0, 1]; multiplies the alpha of the base colour's texture
  float transmission = 0;     ///< [0, 1], KHR_materials_transmission: passes through unscattered

  /// The part of light that is transmitted. A material that emits counts as if it transmitted
  /// nothing: what a lamp's glass gives off is in its emission.
  float transmitted() const { return emitted_luminance == Float3{0, 0, 0} ? transmission : 0; }
};

/// Per-patch quantities, each of n entries.
struct PatchTable {
  std::vector<float> area;               ///< m², > 0; only of surface that stops light
  std::vector<Float3> centroid;          ///< metres
  std::vector<Float3> normal;            ///< unit
  std::vector<Float3> reflectance;       ///< 0 <= rho < 1
  std::vector<Float3> emitted_exitance;  ///< lx, >= 0: pi x mean luminance
  std::vector<float> sky_visibility;     ///< cosine-weighted fraction of rays that escape, [0, 1]
  std::vector<float> absorbed;  ///< cosine-weighted fraction of rays that hit back faces, [0, 1]

  std::size_t size() const { return area.size(); }
};

/// Which patches an operator brings light to, its receivers, and which it takes light from, its
/// sources. A patch may be both, or neither. A patch that is neither still reflects light on its
/// way from sources to receivers.
struct PatchRoles {
  static constexpr std::uint8_t kReceiver = 1, kSource = 2, kBoth = kReceiver | kSource;

  std::vector<std::uint8_t> role;  ///< [n] of these bits; empty: every patch is both

  bool all_are_both() const { return role.empty(); }
  bool is_receiver(std::size_t patch) const { return has(patch, kReceiver); }
  bool is_source(std::size_t patch) const { return has(patch, kSource); }
  bool has(std::size_t patch, std::uint8_t bit) const {
    return role.empty() || (role[patch] & bit) != 0;
  }

  /// How many of `patch_count` patches have `bit`.
  std::size_t count(std::uint8_t bit, std::size_t patch_count) const;

  /// Sets the light [n] of patches without `bit` to 0.
  void keep(std::uint8_t bit, std::span<Float3> light) const;

  bool operator==(const PatchRoles&) const = default;
};

/// The opacity of some triangles by micro-triangles. A map of level L has 4^L of them: each level
/// quarters a triangle at the middles of its sides, and the quarters' maps follow one another in
/// the order first vertex, middle, second vertex, third vertex. The middle one is upside down: its
/// first vertex is opposite the triangle's.
struct OpacityMaps {
  static constexpr int kMaxLevel = 5;
  static constexpr std::uint8_t kOpaque = 255;  ///< stops everything; 0 stops nothing

  /// [t] the map of each triangle, or kNone for an opaque one. Empty where all are opaque.
  std::vector<std::uint32_t> triangle_map;
  std::vector<std::uint32_t> begin;   ///< [m + 1] map k is [begin[k], begin[k + 1]) of `opacity`
  std::vector<std::uint8_t> opacity;  ///< by micro-triangle, of kOpaque

  bool empty() const { return triangle_map.empty(); }
  std::size_t map_count() const { return begin.empty() ? 0 : begin.size() - 1; }

  std::span<const std::uint8_t> map(std::uint32_t index) const {
    return {opacity.data() + begin[index], opacity.data() + begin[index + 1]};
  }

  /// The map of a triangle, of size 4^level; empty if it is opaque.
  std::span<const std::uint8_t> of_triangle(std::uint32_t triangle) const {
    if (empty() || triangle_map[triangle] == kNone) return {};
    return map(triangle_map[triangle]);
  }

  /// The part of a triangle that stops light, [0, 1].
  double stopping_part(std::uint32_t triangle) const;
};

/// The triangles that are shown and that cast shadows. The first `surface_count` triangles are the
/// surface of the scene. The triangles after them are the second sides of double-sided ones, with
/// reversed winding and their own vertices. Rays are traced against the first part only.
struct DisplayMesh {
  std::vector<Float3> position;             ///< [v] metres
  std::vector<Float3> normal;               ///< [v] unit shading normals
  std::vector<Float2> base_color_texcoord;  ///< [v] texture transform applied
  std::vector<Float2> emissive_texcoord;    ///< [v] texture transform applied
  std::vector<Float3> vertex_color;         ///< [v] linear
  std::vector<Uint3> triangle;  ///< [t] vertex indices, counter-clockwise from the front
  std::vector<std::uint32_t> triangle_patch;  ///< [t] patch, or kNone for a side that sees nothing
  std::vector<std::uint32_t> triangle_material;  ///< [t]
  std::vector<std::uint32_t> back_triangle;  ///< [surface_count] second side, or kNone if one-sided
  OpacityMaps opacity;                       ///< opacity of all triangles

  /// Reconstruction: the value at vertex v is the sum of weight x patch value over
  /// [weight_begin[v], weight_begin[v + 1]). The sum of weight x (1 - absorbed) is 1, so that
  /// partly covered patches do not darken the visible surface. A vertex may have no weights.
  std::vector<std::uint32_t> weight_begin;  ///< [v + 1]
  std::vector<std::uint32_t> weight_patch;  ///< patch indices
  std::vector<float> weight;                ///< may be negative: clamp results to >= 0

  std::size_t surface_count() const { return back_triangle.size(); }
};

/// What receivers, vertices of the display mesh or texels of the lightmap, get beyond what the
/// reconstruction weights give them: rows of their own, as the difference from those of their
/// patches. A row is by sets of patches, each taken as if it shone evenly: set k has the patches at
/// the positions [set[k][0], set[k][1]) of `patch`, and its light x is their radiosity in lx,
/// averaged over their area.
///
/// Receivers are in groups of kGroup. All of a group see the same sets; set j of group g is entry
/// e = group_begin[g] + j. To receiver number i of the group it adds value x scale[e] x its light,
/// in lx of irradiance.
struct ReceiverRows {
  static constexpr std::uint32_t kGroup = 64;
  static constexpr std::uint32_t kSetStep = 4;      ///< the sets of a group are a multiple of this
  static constexpr std::uint32_t kMostSets = 1024;  ///< of a group

  std::vector<std::uint32_t> patch;               ///< [n] a permutation
  std::vector<std::array<std::uint32_t, 2>> set;  ///< [m]
  std::vector<std::uint32_t> group_begin;         ///< [g + 1] of entries
  std::vector<std::uint32_t> entry_set;           ///< [q]
  std::vector<float> scale;                       ///< [q]
  std::vector<std::uint32_t> receiver;            ///< [kGroup g] each once at most, or kNone
  /// [kGroup q] the value of receiver i in entry e is at value_index(e, i).
  std::vector<std::int8_t> value;

  bool empty() const { return group_begin.empty(); }
  std::size_t group_count() const { return empty() ? 0 : group_begin.size() - 1; }

  /// Entries by fours, within them receivers by fours.
  static constexpr std::size_t value_index(std::size_t entry, std::size_t in_group) {
    return entry / 4 * 4 * kGroup + in_group / 4 * 16 + entry % 4 * 4 + in_group % 4;
  }
};

/// The directions of the sky in cells: cell 0 is all that is below the horizon, 1 to 145 are those
/// of P. R. Tregenza, "Subdivision of the sky hemisphere for luminance measurements", Lighting
/// Research and Technology 19 (1987), in the order of the daylighting programs: rows of 12 degrees
/// of altitude from the horizon up, each from north clockwise (seen from above), its first cell
/// around north; the last cell is the zenith. Up is +y, north -z, east +x.
inline constexpr std::uint32_t kSkyCellCount = 146;

/// How much of each cell the patches see.
struct SkyCells {
  /// Those that patch i sees are [entry_begin[i], entry_begin[i + 1]), ascending.
  std::vector<std::uint32_t> entry_begin;  ///< [n + 1]
  std::vector<std::uint8_t> entry_cell;
  /// Cosine-weighted fraction of the patch's view, (0, 1]: their sum is the patch's sky_visibility.
  std::vector<float> entry_part;

  bool empty() const { return entry_begin.empty(); }
};

/// What places see of each cell of the sky, as spherical harmonics: for a sky whose
/// cell c has luminance L(c) in cd/m², the coefficients at place i are the sum of entry_weight x
/// L(entry_cell) over [entry_begin[i], entry_begin[i + 1]), in cd/m².
template <typename Weight>
struct SkyHarmonics {
  std::vector<std::uint32_t> entry_begin;  ///< [places + 1]
  std::vector<std::uint8_t> entry_cell;    ///< ascending for each place
  std::vector<Weight> entry_weight;

  bool empty() const { return entry_begin.empty(); }
};

/// Real spherical harmonics of degree 0 to 2: coefficients or values, in the order
/// (0,0), (1,-1), (1,0), (1,1), (2,-2), (2,-1), (2,0), (2,1), (2,2).
inline constexpr std::size_t kHarmonicCount = 9;
using Harmonics = std::array<float, kHarmonicCount>;

/// Points in the air, and for each the linear map from the radiosity of the patches to the
/// incoming radiance there, as coefficients of spherical harmonics.
struct LightProbes {
  std::vector<Float3> position;       ///< [p] metres
  std::vector<std::uint8_t> valid;    ///< [p] 0: within a wall or behind surfaces, without entries
  std::vector<Harmonics> sky;         ///< [p] of a sky of luminance 1
  SkyHarmonics<Harmonics> sky_cells;  ///< [p] may be empty: then the sky is taken for uniform
  /// What probe k sees of patches is [entry_begin[k], entry_begin[k + 1]): with radiosity B in lx
  /// the coefficients are the sum of entry_weight x B[entry_patch], in cd/m².
  std::vector<std::uint32_t> entry_begin = {0};  ///< [p + 1]
  std::vector<std::uint32_t> entry_patch;
  std::vector<Harmonics> entry_weight;
  /// Probes along x, y and z, x fastest, evenly spaced from the first to the last; zeros if they
  /// are no grid.
  Uint3 grid{0, 0, 0};
  std::size_t patch_count = 0;  ///< n: entry_patch is below it

  std::size_t size() const { return position.size(); }
};

/// Coefficients or values of the real spherical harmonics of degree 0 and 1, in the order (0,0),
/// (1,-1), (1,0), (1,1), orthonormal over the sphere.
inline constexpr std::size_t kLinearHarmonicCount = 4;
using LinearHarmonics = std::array<float, kLinearHarmonicCount>;

/// Where the light comes from that arrives at the patches: for each the linear map from the
/// radiosity of the patches to the radiance over its hemisphere (the mean over its area), as
/// spherical harmonics in the world's axes.
struct SurfaceHarmonics {
  std::vector<LinearHarmonics> sky;         ///< [n] of a sky of luminance 1
  SkyHarmonics<LinearHarmonics> sky_cells;  ///< [n] may be empty: then the sky is taken for uniform
  /// What patch i sees is [entry_begin[i], entry_begin[i + 1]): with radiosity B in lx the
  /// coefficients are the sum of entry_weight x B[entry_patch], in cd/m².
  std::vector<std::uint32_t> entry_begin;  ///< [n + 1]
  std::vector<std::uint32_t> entry_patch;
  std::vector<LinearHarmonics> entry_weight;

  bool empty() const { return sky.empty(); }
};

/// One texture for the light of all display triangles that have a place in it, as a sparse linear
/// map: the value of a texel is that of a place on the display mesh, interpolated between the
/// vertices of its triangle, whose values are in turn a linear map of the patches'
/// (DisplayMesh::weight), and what a row of its own adds (SceneData::texel_rows). Texels around a
/// chart continue it, for filters that reach over its rim.
struct Lightmap {
  std::uint32_t width = 0, height = 0;  ///< texels; zeros: there is no lightmap
  /// [v] of the display mesh, in [0, 1], (0, 0) the upper left corner of the texture; (0, 0) where
  /// a vertex has no place.
  std::vector<Float2> texcoord;
  std::vector<std::uint8_t> has_texels;  ///< [t] 1 for display triangles that have a place
  std::vector<std::uint32_t> triangle;   ///< [height][width] display triangle, or kNone
  std::vector<Float2> weight;  ///< [height][width] barycentric, of its second and third vertex

  bool empty() const { return width == 0; }
};

/// How the data were made, and how good they were measured to be.
struct BuildRecord {
  std::string generator;      ///< program and version
  std::string scene_name;     ///< file name of the source, without its folder
  std::string scene_hash;     ///< "xxh3:" + 32 hexadecimal digits over the source and its buffers
  double solve_residual = 0;  ///< largest relative residual of Y (I - rho F) = F over random light
  double tolerance = 0;       ///< asked for; 0 for operators that are not hierarchical
  double error_mean = 0;      ///< relative area-weighted L2 error of H, mean over point lights
  double error_max = 0;       ///< the largest of these
  double error_bound = 0;     ///< see notes/reference/file_format.md
};

/// What a transfer file says of its scene: all that is in it but form factors and operator.
struct SceneData {
  PatchTable patches;
  DisplayMesh mesh;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Camera> cameras;
  std::vector<Light> lights;
  SkyCells sky_cells;                  ///< may be empty: then the sky is uniform
  LightProbes probes;                  ///< may be none
  Lightmap lightmap;                   ///< may be empty
  SurfaceHarmonics surface_harmonics;  ///< may be empty
  ReceiverRows receiver_rows;          ///< of vertices of the mesh; may be empty
  ReceiverRows texel_rows;             ///< of texels of the lightmap; may be empty
  BuildRecord record;
};

}  // namespace rebounce

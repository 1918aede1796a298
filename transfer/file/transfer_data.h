#pragma once

// The contents of a transfer file in memory: patches, display mesh, form factors, operator, and the
// record of how they were made. transfer_file.h reads and writes it.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "transfer/base/types.h"
#include "transfer/data/light_probes.h"
#include "transfer/data/lightmap.h"
#include "transfer/data/opacity_maps.h"
#include "transfer/data/scene_description.h"
#include "transfer/data/surface_harmonics.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce {

class HierarchicalOperator;

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

/// How the data were made, and their measured accuracy.
struct BuildRecord {
  std::string generator;      ///< program and version
  std::string scene_name;     ///< file name of the source, without its folder
  std::string scene_hash;     ///< "xxh3:" + 32 hexadecimal digits over the source and its buffers
  std::string settings_json;  ///< every setting of the build, one JSON object
  std::string report_json;    ///< scene report, seconds by phase, rays: one JSON object
  double solve_residual = 0;  ///< max relative residual of Y (I - rho F) = F over random probes
  double tolerance = 0;       ///< requested; 0 for a dense operator, which is exact up to rounding
  double error_mean = 0;      ///< relative area-weighted L2 error of H over test lights
  double error_max = 0;
  double error_bound = 0;  ///< see notes/file_format.md
};

struct TransferData {
  PatchTable patches;
  DisplayMesh mesh;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Camera> cameras;
  std::vector<Light> lights;
  SkyCells sky_cells;                  ///< may be empty: then the sky is uniform
  LightProbes probes;                  ///< may be empty
  Lightmap lightmap;                   ///< may be empty
  SurfaceHarmonics surface_harmonics;  ///< may be empty
  /// F M_e [n] in lx: the irradiance directly from emitters. Empty if nothing emits, or if F is
  /// stored and gives it.
  std::vector<Float3> emitted_irradiance;
  /// F by pairs of patches. Empty if pairs are not stored: then use compressed_form_factors.
  ExchangeMatrix exchange;
  /// G = A^1/2 F A^-1/2 compressed, one matrix for the three channels (CompressedFormFactors). Null
  /// if it is not stored.
  std::shared_ptr<const HierarchicalOperator> compressed_form_factors;
  FormFactorLinks links;  ///< empty unless they were requested
  std::shared_ptr<const TransferOperator> transfer;
  BuildRecord record;
};

}  // namespace rebounce

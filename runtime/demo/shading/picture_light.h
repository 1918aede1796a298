#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/sky.h"
#include "runtime/demo/shading/display_surface.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The light to draw with. Per-patch arrays have n entries or none (zero everywhere).
struct PictureLight {
  std::span<const Light> lights{};
  Sky sky{};
  std::span<const Float3> indirect_irradiance{};  ///< H = F B in lx, the product of the operator
  /// F M_e in lx: the part of H that comes directly from emitters. The picture computes this part
  /// for every pixel, with sharp shadows, and takes only the rest of H from the patches.
  std::span<const Float3> emitted_irradiance{};
  /// B - M_e in lx: what patches reflect. Rows of vertices and texels add their part of it; without
  /// it they are left out.
  std::span<const Float3> reflected_exitance{};
  std::span<const float> error{};  ///< >= 0, drawn by Show::kError
};

/// B - M_e [n] in lx of the last frame.
std::vector<Float3> reflected_exitance(const Engine& engine);

/// The light of one picture as values at the vertices [v], in lx.
struct VertexLight {
  std::vector<glm::vec3> sky;
  std::vector<glm::vec3> bounced;  ///< H without the emitters' first flight
};

/// Throws Error if an array of `light` has neither no entries nor one for each patch.
VertexLight light_at_vertices(const TransferData& data, const PictureLight& light);

/// What rows of texels add to the bounced light there [texels], in lx; empty if there are none.
/// Throws Error as light_at_vertices does.
std::vector<Float3> added_at_texels(const TransferData& data, const PictureLight& light);

/// Values at the vertices from values of the patches; zero where a vertex has no weights or
/// `patch_value` is empty.
std::vector<glm::vec3> reconstruct_at_vertices(const DisplayMesh& mesh,
                                               std::span<const glm::vec3> patch_value);

/// The vertex values interpolated at `point`.
glm::vec3 interpolate(const DisplayMesh& mesh, std::span<const glm::vec3> vertex_value,
                      const SurfacePoint& point);

/// Throws Error if `length` is neither 0 nor `patch_count`.
void check_length(std::size_t length, std::size_t patch_count, const char* name);

}  // namespace rebounce

#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "runtime/demo/image/filtered_texture.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A point on one side of the surface, with the quantities that shading needs.
struct SurfacePoint {
  std::uint32_t triangle = kNone;  ///< of the display mesh
  glm::vec3 weight{0, 0, 0};       ///< barycentric, of its three vertices
  glm::vec3 position{0, 0, 0};
  glm::vec3 geometric_normal{0, 0, 0};  ///< unit, on the visible side
  glm::vec3 shading_normal{0, 0, 0};    ///< unit, interpolated
};

/// The display mesh with decoded textures: geometry and materials at any point.
class DisplaySurface {
 public:
  /// `data` must outlive it. Throws Error if a texture cannot be decoded.
  explicit DisplaySurface(const TransferData& data);

  const DisplayMesh& mesh() const { return data_->mesh; }

  /// The point at barycentric `weight` on `triangle` of the display mesh.
  SurfacePoint point_on(std::uint32_t triangle, const glm::vec3& weight) const;

  /// The point that a ray hit; on the second side's triangle if the ray came from behind.
  SurfacePoint point_at(const Hit& hit) const;

  /// Linear diffuse reflectance, filtered over `width` metres of surface.
  glm::vec3 albedo(const SurfacePoint& point, float width) const;

  /// The same without its texture.
  glm::vec3 untextured_albedo(const SurfacePoint& point) const;

  /// The fraction of light that does not pass through the surface, [0, 1]; 0 or 1 for masks.
  float opacity(const Hit& hit) const;

  /// Emitted luminance in cd/m², filtered over `width` metres of surface.
  glm::vec3 emitted_luminance(const SurfacePoint& point, float width) const;

 private:
  const Material& material_of(const SurfacePoint& point) const;
  glm::vec3 texture_color(std::uint32_t texture, std::span<const Float2> texcoord,
                          const SurfacePoint& point, float width) const;
  glm::vec2 texcoord_at(std::span<const Float2> texcoord, const SurfacePoint& point) const;

  const TransferData* data_;
  std::vector<std::unique_ptr<const FilteredTexture>> textures_;  // null if not used
};

/// The smallest t_near of a ray that continues from `hit`.
float beyond(const Hit& hit);

/// True if the hit is invisible: the back of a one-sided surface.
bool is_culled(const DisplayMesh& mesh, const Hit& hit);

/// Finds the nearest visible surface of each ray, through culled surfaces and through transparent
/// texels at the full resolution of the textures. `hits` is like that of RayTracer::intersect.
/// Advances rays[k].t_near beyond the surfaces that ray k passed.
void intersect_visible(const RayTracer& tracer, const DisplaySurface& surface, std::span<Ray> rays,
                       std::span<Hit> hits);

/// The same with opacity maps instead of textures.
void intersect_visible(const RayTracer& tracer, const DisplayMesh& mesh, std::span<Ray> rays,
                       std::span<Hit> hits);

}  // namespace rebounce

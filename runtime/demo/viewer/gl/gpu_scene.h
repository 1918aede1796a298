#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "runtime/demo/viewer/gl/gl_objects.h"
#include "runtime/demo/viewer/gl/gl_program.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Which of two solutions a part of the screen shows.
enum class Side : std::uint8_t { kFirst, kSecond };
inline constexpr std::size_t kSideCount = 2;

/// A scene on the graphics card. Geometry is uploaded once, light in each frame.
class GpuScene {
 public:
  /// Throws Error if a texture cannot be decoded.
  explicit GpuScene(const TransferData& data);

  /// Uploads the direct light of sky and emitters at the vertices [v], lx.
  void upload_first_flight(std::span<const glm::vec3> value);
  /// Uploads the bounced light at the vertices [v], lx.
  void upload_bounced(Side side, std::span<const glm::vec3> value);
  /// A buffer for the bounced light at the vertices [v] that the graphics card writes, three floats
  /// each, lx.
  GLuint bounced_buffer(Side side);
  /// Uploads a linear colour for each patch [n].
  void upload_patch_colors(Side side, std::span<const glm::vec3> color);

  /// Draws every material in turn. Binds its textures to units 0 (base colour) and 1 (emissive) and
  /// sets base_color, emitted_luminance, base_alpha and alpha_cutoff. Shaders discard fragments
  /// whose texture alpha times base_alpha is below alpha_cutoff.
  void draw_materials(const GlProgram& program, Side side) const;
  /// Sets the same for an object that is drawn next, white and without textures.
  void set_plain_material(const GlProgram& program, const Float3& emitted_luminance) const;
  /// Draws with the colours of patches at texture units 0 and 1; sets first_triangle.
  void draw_patches(const GlProgram& program, Side side) const;
  /// Draws the surface once, for shadows; binds base colours to unit 0 and sets base_alpha and
  /// alpha_cutoff.
  void draw_surface(const GlProgram& program) const;
  /// The same, of what is one-sided and seen from its back.
  void draw_backs(const GlProgram& program) const;

 private:
  // Triangles of one material.
  struct Range {
    std::uint32_t material = 0;
    std::uint32_t begin = 0, end = 0;
    bool two_sided = false;  // of the surface
  };

  void sort_triangles();
  void sort_surface();
  void make_vertex_arrays();
  void load_textures();
  GLuint texture_name(std::uint32_t texture) const;
  void draw_range(const Range& range) const;
  void draw_caster(const GlProgram& program, const Range& range) const;

  const TransferData& data_;
  std::vector<Range> ranges_, surface_ranges_;
  GlBuffer static_vertices_, sorted_indices_, surface_indices_, first_flight_;
  std::array<GlBuffer, kSideCount> bounced_;
  std::array<GlVertexArray, kSideCount> vertex_arrays_;
  GlVertexArray surface_array_;
  GlBuffer triangle_patches_;
  GlTexture triangle_patch_texture_;
  std::array<GlBuffer, kSideCount> patch_colors_;
  std::array<GlTexture, kSideCount> patch_color_textures_;
  std::vector<GlTexture> textures_;  // one for each of the scene's
  GlTexture white_;
};

}  // namespace rebounce

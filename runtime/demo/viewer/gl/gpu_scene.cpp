#include "runtime/demo/viewer/gl/gpu_scene.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "runtime/demo/image/decoded_image.h"
#include "runtime/demo/viewer/gl/vertex_layout.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// The attributes of a vertex that never change.
struct StaticVertex {
  Float3 position, normal, color;
  Float2 base_color_texcoord, emissive_texcoord;
};

std::vector<StaticVertex> static_vertices(const DisplayMesh& mesh) {
  std::vector<StaticVertex> vertices(mesh.position.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    vertices[v] = {mesh.position[v], mesh.normal[v], mesh.vertex_color[v],
                   mesh.base_color_texcoord[v], mesh.emissive_texcoord[v]};
  }
  return vertices;
}

GLint wrap_code(TextureWrap wrap) {
  if (wrap == TextureWrap::kClampToEdge) return GL_CLAMP_TO_EDGE;
  return wrap == TextureWrap::kMirroredRepeat ? GL_MIRRORED_REPEAT : GL_REPEAT;
}

std::vector<std::uint8_t> with_alpha(const DecodedImage& image) {
  std::vector<std::uint8_t> texels;
  texels.reserve(4 * image.alpha.size());
  for (std::size_t k = 0; k < image.alpha.size(); ++k) {
    const std::uint8_t* rgb = &image.rgb[3 * k];
    texels.insert(texels.end(), {rgb[0], rgb[1], rgb[2], image.alpha[k]});
  }
  return texels;
}

void upload_image(const GlTexture& texture, const DecodedImage& image) {
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  if (image.alpha.empty()) {
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8, image.width, image.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 image.rgb.data());
  } else {
    glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, image.width, image.height, 0, GL_RGBA,
                 GL_UNSIGNED_BYTE, with_alpha(image).data());
  }
  glGenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
}

void attach_table(const GlTexture& texture, GLenum format, const GlBuffer& buffer) {
  glBindTexture(GL_TEXTURE_BUFFER, texture.name());
  glTexBuffer(GL_TEXTURE_BUFFER, format, buffer.name());
}

// Shaders discard fragments whose texture alpha times base_alpha is below alpha_cutoff.
struct AlphaTest {
  float base_alpha, alpha_cutoff;
  bool operator==(const AlphaTest&) const = default;

  void set(const GlProgram& program) const {
    program.set("base_alpha", base_alpha);
    program.set("alpha_cutoff", alpha_cutoff);
  }
};

constexpr AlphaTest kAllThere{1, -1}, kNotThere{0, 1};

// Like DisplaySurface::opacity, but rounded to 0 or 1.
AlphaTest alpha_test(const Material& material) {
  const float solid = 1 - material.transmitted();
  constexpr float kHalf = 0.5F;
  if (material.alpha_mode == AlphaMode::kBlend) return {material.base_alpha * solid, kHalf};
  if (solid < kHalf) return kNotThere;
  if (material.alpha_mode == AlphaMode::kOpaque) return kAllThere;
  return {material.base_alpha, material.alpha_cutoff};
}

void bind(int unit, GLenum target, GLuint texture) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(target, texture);
}

}  // namespace

GpuScene::GpuScene(const TransferData& data) : data_(data) {
  fill<StaticVertex>(GL_ARRAY_BUFFER, static_vertices_, static_vertices(data.mesh), GL_STATIC_DRAW);
  const std::vector<glm::vec3> dark(data.mesh.position.size(), glm::vec3(0));
  upload_first_flight(dark);
  const std::vector<glm::vec3> black(data.patches.size(), glm::vec3(0));
  for (const Side side : {Side::kFirst, Side::kSecond}) {
    upload_bounced(side, dark);
    upload_patch_colors(side, black);
    const auto k = static_cast<std::size_t>(side);
    attach_table(patch_color_textures_[k], GL_RGBA32F, patch_colors_[k]);
  }
  sort_triangles();
  sort_surface();
  make_vertex_arrays();
  load_textures();
}

void GpuScene::sort_triangles() {
  const DisplayMesh& mesh = data_.mesh;
  std::vector<std::uint32_t> order(mesh.triangle.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t t) { return mesh.triangle_material[t]; });
  std::vector<Uint3> triangles;
  std::vector<std::uint32_t> patches;
  for (std::uint32_t k = 0; k < order.size(); ++k) {
    const std::uint32_t material = mesh.triangle_material[order[k]];
    if (ranges_.empty() || ranges_.back().material != material) ranges_.push_back({material, k, k});
    ranges_.back().end = k + 1;
    triangles.push_back(mesh.triangle[order[k]]);
    patches.push_back(mesh.triangle_patch[order[k]]);
  }
  fill<Uint3>(GL_ARRAY_BUFFER, sorted_indices_, triangles, GL_STATIC_DRAW);
  fill<std::uint32_t>(GL_TEXTURE_BUFFER, triangle_patches_, patches, GL_STATIC_DRAW);
  attach_table(triangle_patch_texture_, GL_R32UI, triangle_patches_);
}

/// Opaque surface comes first: what is one-sided as one range, then the rest.
void GpuScene::sort_surface() {
  const DisplayMesh& mesh = data_.mesh;
  const auto is_two_sided = [&](std::uint32_t t) { return mesh.back_triangle[t] != kNone; };
  const auto group = [&](std::uint32_t t) {
    const std::uint32_t material = mesh.triangle_material[t];
    const std::uint32_t kind =
        alpha_test(data_.materials[material]) == kAllThere ? 0 : material + 1;
    return 2 * kind + static_cast<std::uint32_t>(is_two_sided(t));
  };
  std::vector<std::uint32_t> order(mesh.surface_count());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, {}, group);
  std::vector<Uint3> triangles;
  for (std::uint32_t k = 0; k < order.size(); ++k) {
    if (k == 0 || group(order[k]) != group(order[k - 1])) {
      surface_ranges_.push_back({mesh.triangle_material[order[k]], k, k, is_two_sided(order[k])});
    }
    surface_ranges_.back().end = k + 1;
    triangles.push_back(mesh.triangle[order[k]]);
  }
  fill<Uint3>(GL_ARRAY_BUFFER, surface_indices_, triangles, GL_STATIC_DRAW);
}

void GpuScene::make_vertex_arrays() {
  for (std::size_t side = 0; side < kSideCount; ++side) {
    glBindVertexArray(vertex_arrays_[side].name());
    glBindBuffer(GL_ARRAY_BUFFER, static_vertices_.name());
    constexpr std::size_t kStride = sizeof(StaticVertex);
    point_to(kPositionAttribute, 3, kStride, offsetof(StaticVertex, position));
    point_to(kNormalAttribute, 3, kStride, offsetof(StaticVertex, normal));
    point_to(kColorAttribute, 3, kStride, offsetof(StaticVertex, color));
    point_to(kBaseColorTexcoordAttribute, 2, kStride, offsetof(StaticVertex, base_color_texcoord));
    point_to(kEmissiveTexcoordAttribute, 2, kStride, offsetof(StaticVertex, emissive_texcoord));
    glBindBuffer(GL_ARRAY_BUFFER, first_flight_.name());
    point_to(kFirstFlightAttribute, 3, sizeof(glm::vec3), 0);
    glBindBuffer(GL_ARRAY_BUFFER, bounced_[side].name());
    point_to(kBouncedAttribute, 3, sizeof(glm::vec3), 0);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, sorted_indices_.name());
  }
  glBindVertexArray(surface_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, static_vertices_.name());
  point_to(kPositionAttribute, 3, sizeof(StaticVertex), offsetof(StaticVertex, position));
  point_to(kNormalAttribute, 3, sizeof(StaticVertex), offsetof(StaticVertex, normal));
  point_to(kBaseColorTexcoordAttribute, 2, sizeof(StaticVertex),
           offsetof(StaticVertex, base_color_texcoord));
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, surface_indices_.name());
  glBindVertexArray(0);
}

void GpuScene::load_textures() {
  upload_image(white_, {.width = 1, .height = 1, .rgb = {255, 255, 255}});
  textures_.resize(data_.textures.size());
  std::vector<bool> loaded(textures_.size(), false);
  for (const Material& material : data_.materials) {
    for (const std::uint32_t t : {material.base_color_texture, material.emissive_texture}) {
      if (t == kNone || loaded[t]) continue;
      loaded[t] = true;
      upload_image(textures_[t], decode_image(data_.textures[t]));
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, wrap_code(data_.textures[t].wrap_s));
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, wrap_code(data_.textures[t].wrap_t));
    }
  }
}

void GpuScene::upload_first_flight(std::span<const glm::vec3> value) {
  fill(GL_ARRAY_BUFFER, first_flight_, value, GL_STREAM_DRAW);
}

void GpuScene::upload_bounced(Side side, std::span<const glm::vec3> value) {
  fill(GL_ARRAY_BUFFER, bounced_[static_cast<std::size_t>(side)], value, GL_STREAM_DRAW);
}

GLuint GpuScene::bounced_buffer(Side side) {
  const GlBuffer& buffer = bounced_[static_cast<std::size_t>(side)];
  glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
  glBufferData(GL_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(data_.mesh.position.size() * sizeof(glm::vec3)), nullptr,
               GL_STREAM_DRAW);
  return buffer.name();
}

void GpuScene::upload_patch_colors(Side side, std::span<const glm::vec3> color) {
  // Buffer textures with three floats need OpenGL 4.
  std::vector<glm::vec4> padded;
  padded.reserve(color.size());
  for (const glm::vec3& c : color) padded.emplace_back(c, 1);
  fill<glm::vec4>(GL_TEXTURE_BUFFER, patch_colors_[static_cast<std::size_t>(side)], padded,
                  GL_STREAM_DRAW);
}

GLuint GpuScene::texture_name(std::uint32_t texture) const {
  return texture == kNone ? white_.name() : textures_[texture].name();
}

void GpuScene::draw_range(const Range& range) const {
  const std::size_t offset = range.begin * sizeof(Uint3);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * (range.end - range.begin)), GL_UNSIGNED_INT,
                 reinterpret_cast<const void*>(offset));  // NOLINT: OpenGL's interface
}

void GpuScene::draw_materials(const GlProgram& program, Side side) const {
  glBindVertexArray(vertex_arrays_[static_cast<std::size_t>(side)].name());
  for (const Range& range : ranges_) {
    const Material& material = data_.materials[range.material];
    bind(0, GL_TEXTURE_2D, texture_name(material.base_color_texture));
    bind(1, GL_TEXTURE_2D, texture_name(material.emissive_texture));
    program.set("base_color", to_glm(material.base_color));
    program.set("emitted_luminance", to_glm(material.emitted_luminance));
    alpha_test(material).set(program);
    draw_range(range);
  }
}

void GpuScene::set_plain_material(const GlProgram& program, const Float3& emitted_luminance) const {
  bind(0, GL_TEXTURE_2D, white_.name());
  bind(1, GL_TEXTURE_2D, white_.name());
  program.set("base_color", glm::vec3(1));
  program.set("emitted_luminance", to_glm(emitted_luminance));
  kAllThere.set(program);
}

void GpuScene::draw_patches(const GlProgram& program, Side side) const {
  glBindVertexArray(vertex_arrays_[static_cast<std::size_t>(side)].name());
  bind(0, GL_TEXTURE_BUFFER, triangle_patch_texture_.name());
  bind(1, GL_TEXTURE_BUFFER, patch_color_textures_[static_cast<std::size_t>(side)].name());
  for (const Range& range : ranges_) {
    program.set("first_triangle", static_cast<int>(range.begin));
    draw_range(range);
  }
}

void GpuScene::draw_surface(const GlProgram& program) const {
  glBindVertexArray(surface_array_.name());
  for (const Range& range : surface_ranges_) draw_caster(program, range);
}

void GpuScene::draw_backs(const GlProgram& program) const {
  glBindVertexArray(surface_array_.name());
  glEnable(GL_CULL_FACE);
  glCullFace(GL_FRONT);
  for (const Range& range : surface_ranges_) {
    if (!range.two_sided) draw_caster(program, range);
  }
  glCullFace(GL_BACK);
  glDisable(GL_CULL_FACE);
}

void GpuScene::draw_caster(const GlProgram& program, const Range& range) const {
  const Material& material = data_.materials[range.material];
  bind(0, GL_TEXTURE_2D, texture_name(material.base_color_texture));
  alpha_test(material).set(program);
  draw_range(range);
}

}  // namespace rebounce

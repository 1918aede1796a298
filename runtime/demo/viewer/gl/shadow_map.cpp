#include "runtime/demo/viewer/gl/shadow_map.h"

#include <algorithm>
#include <array>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>

#include "runtime/demo/viewer/gl/lamp_shader.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// Texels per side.
constexpr int kPlaneSide = 4096, kPlaceSide = 512;

// Fraction of the scene's diagonal: nearer objects, such as a lamp's own housing, cast no shadow.
constexpr float kShadowNearPart = 1e-3F;
// Fraction of the scene's diagonal: receivers are moved off their surface by at least this.
constexpr float kOffsetPart = 1e-4F;

struct CubeFace {
  GLenum target;
  glm::vec3 forward, up;
};

const std::array<CubeFace, 6> kFaces = {{
    {GL_TEXTURE_CUBE_MAP_POSITIVE_X, {1, 0, 0}, {0, -1, 0}},
    {GL_TEXTURE_CUBE_MAP_NEGATIVE_X, {-1, 0, 0}, {0, -1, 0}},
    {GL_TEXTURE_CUBE_MAP_POSITIVE_Y, {0, 1, 0}, {0, 0, 1}},
    {GL_TEXTURE_CUBE_MAP_NEGATIVE_Y, {0, -1, 0}, {0, 0, -1}},
    {GL_TEXTURE_CUBE_MAP_POSITIVE_Z, {0, 0, 1}, {0, -1, 0}},
    {GL_TEXTURE_CUBE_MAP_NEGATIVE_Z, {0, 0, -1}, {0, -1, 0}},
}};

void set_comparing(GLenum target) {
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(target, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
}

void allocate(GLenum target, int side) {
  glTexImage2D(target, 0, GL_DEPTH_COMPONENT32F, side, side, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
               nullptr);
}

void allocate_layers(int side, int count) {
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, side, side, count, 0,
               GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
}

using MapKind = ShadowMapKind;

MapKind kind_of(const Light& light) {
  return lamp_kind(light.type).shadow_map;
}

bool casts_alike(const Light& a, const Light& b) {
  if (a.type != b.type) return false;
  switch (kind_of(a)) {
    case MapKind::kPlane:
      return a.direction == b.direction;
    case MapKind::kCube:
      return a.position == b.position;
    case MapKind::kPlaces:
      break;
  }
  return a.position == b.position && a.direction == b.direction && a.tangent == b.tangent &&
         a.radius == b.radius && a.size == b.size;
}

std::array<glm::vec3, 8> corners_of(const SceneBounds& bounds) {
  std::array<glm::vec3, 8> corners;
  for (int k = 0; k < 8; ++k) {
    corners[static_cast<std::size_t>(k)] = {(k & 1) != 0 ? bounds.high.x : bounds.low.x,
                                            (k & 2) != 0 ? bounds.high.y : bounds.low.y,
                                            (k & 4) != 0 ? bounds.high.z : bounds.low.z};
  }
  return corners;
}

}  // namespace

ShadowMap::ShadowMap() {
  glBindTexture(GL_TEXTURE_CUBE_MAP, cube_.name());
  for (const CubeFace& face : kFaces) allocate(face.target, 1);
  set_comparing(GL_TEXTURE_CUBE_MAP);
  glBindTexture(GL_TEXTURE_2D, plane_.name());
  allocate(GL_TEXTURE_2D, 1);
  set_comparing(GL_TEXTURE_2D);
  glBindTexture(GL_TEXTURE_2D_ARRAY, places_.name());
  allocate_layers(1, 1);
  set_comparing(GL_TEXTURE_2D_ARRAY);
  glSamplerParameteri(depth_sampler_.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glSamplerParameteri(depth_sampler_.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

void ShadowMap::update(const Light& light, const ShadowCasters& casters, const GlProgram& program,
                       int cube_side) {
  // The memory of another kind of map is given back.
  if (drawn_ && kind_of(light) != kind_of(drawn_for_)) *this = ShadowMap();
  const bool has_side = kind_of(light) != MapKind::kCube || cube_side == cube_side_;
  if (drawn_ && has_side && casters.version == drawn_version_ && casts_alike(light, drawn_for_))
    return;
  smallest_offset_ = kOffsetPart * casters.bounds.diagonal();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  program.use();
  program.set("base_color_texture", 0);
  switch (kind_of(light)) {
    case MapKind::kPlane:
      draw_plane(light, casters, program);
      break;
    case MapKind::kCube:
      draw_cube(light, casters, program, cube_side);
      break;
    case MapKind::kPlaces:
      draw_places(light, casters, program);
      break;
  }
  drawn_ = true;
  drawn_version_ = casters.version;
  drawn_for_ = light;
}

template <typename Attach>
void ShadowMap::draw_faces(const glm::vec3& eye, int side, const ShadowCasters& casters,
                           const GlProgram& program, const Attach& attach) {
  texel_ = 2.0F / static_cast<float>(side);
  const glm::mat4 projection =
      glm::perspective(glm::radians(90.0F), 1.0F, near_far_.x, near_far_.y);
  glViewport(0, 0, side, side);
  program.set("texel", texel_);
  program.set("from_eye", 1);
  program.set("eye", eye);
  for (const CubeFace& face : kFaces) {
    attach(face);
    glClear(GL_DEPTH_BUFFER_BIT);
    program.set("clip_from_world", projection * glm::lookAt(eye, eye + face.forward, face.up));
    casters.draw(program);
  }
}

void ShadowMap::set_reach(const glm::vec3& eye, const SceneBounds& bounds) {
  const glm::vec3 centre = 0.5F * (bounds.low + bounds.high);
  near_far_ = {kShadowNearPart * bounds.diagonal(), bounds.diagonal() + glm::distance(eye, centre)};
}

void ShadowMap::draw_cube(const Light& light, const ShadowCasters& casters,
                          const GlProgram& program, int side) {
  glBindTexture(GL_TEXTURE_CUBE_MAP, cube_.name());
  if (side != cube_side_) {
    for (const CubeFace& face : kFaces) allocate(face.target, side);
    cube_side_ = side;
  }
  const glm::vec3 eye = to_glm(light.position);
  set_reach(eye, casters.bounds);
  draw_faces(eye, side, casters, program, [&](const CubeFace& face) {
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, face.target, cube_.name(), 0);
  });
}

void ShadowMap::draw_places(const Light& light, const ShadowCasters& casters,
                            const GlProgram& program) {
  constexpr int kFaceCount = static_cast<int>(kFaces.size());
  glBindTexture(GL_TEXTURE_2D_ARRAY, places_.name());
  if (!drawn_) allocate_layers(kPlaceSide, kFaceCount * static_cast<int>(kLampPlaceCount));
  set_reach(to_glm(light.position), casters.bounds);
  int layer = 0;
  const PreparedLight lamp(light);
  for (std::uint32_t k = 0; k < kLampPlaceCount; ++k) {
    const glm::vec3 place = lamp.kind->surface->place(lamp, k, kLampPlaceCount);
    draw_faces(to_glm(light.position) + place, kPlaceSide, casters, program, [&](const CubeFace&) {
      glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, places_.name(), 0, layer++);
    });
  }
}

void ShadowMap::draw_plane(const Light& light, const ShadowCasters& casters,
                           const GlProgram& program) {
  const SceneBounds& bounds = casters.bounds;
  glBindTexture(GL_TEXTURE_2D, plane_.name());
  if (!drawn_) allocate(GL_TEXTURE_2D, kPlaneSide);
  const glm::mat3 frame(frame_around(-to_dvec3(light.direction)));
  const glm::mat3 plane_axes = glm::transpose(frame);
  glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
  for (const glm::vec3& corner : corners_of(bounds)) {
    low = glm::min(low, plane_axes * corner);
    high = glm::max(high, plane_axes * corner);
  }
  const float margin = 0.01F * bounds.diagonal();
  plane_from_world_ = glm::ortho(low.x - margin, high.x + margin, low.y - margin, high.y + margin,
                                 -high.z - margin, -low.z + margin) *
                      glm::mat4(plane_axes);
  const glm::mat4 texture_from_world = glm::translate(glm::mat4(1), glm::vec3(0.5F)) *
                                       glm::scale(glm::mat4(1), glm::vec3(0.5F)) *
                                       plane_from_world_;
  std::copy_n(glm::value_ptr(texture_from_world), 16, plane_view_.texture_from_world.begin());
  texel_ = (std::max(high.x - low.x, high.y - low.y) + 2 * margin) / static_cast<float>(kPlaneSide);
  glViewport(0, 0, kPlaneSide, kPlaneSide);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, plane_.name(), 0);
  glClear(GL_DEPTH_BUFFER_BIT);
  program.set("texel", texel_);
  program.set("from_eye", 0);
  program.set("clip_from_world", plane_from_world_);
  casters.draw(program);
}

GpuLamp ShadowMap::for_card(const Light& light) const {
  if (kind_of(light) == MapKind::kPlane) {
    return {.light = light,
            .shadow_map = GpuShadowMap::kPlane,
            .texture = plane_.name(),
            .views = {&plane_view_, 1}};
  }
  return {.light = light,
          .shadow_map = GpuShadowMap::kCube,
          .texture = cube_.name(),
          .depth_range = {near_far_.x, near_far_.y}};
}

void ShadowMap::bind(const GlProgram& program) const {
  glActiveTexture(GL_TEXTURE2);
  glBindTexture(GL_TEXTURE_CUBE_MAP, cube_.name());
  glActiveTexture(GL_TEXTURE3);
  glBindTexture(GL_TEXTURE_2D, plane_.name());
  glActiveTexture(GL_TEXTURE4);
  glBindTexture(GL_TEXTURE_2D_ARRAY, places_.name());
  glActiveTexture(GL_TEXTURE5);
  glBindTexture(GL_TEXTURE_2D_ARRAY, places_.name());
  glBindSampler(5, depth_sampler_.name());
  program.set("cube_shadow", 2);
  program.set("place_shadow", 4);
  program.set("place_depth", 5);
  program.set("plane_shadow", 3);
  program.set("plane_from_world", plane_from_world_);
  program.set("near_far", near_far_);
  program.set("texel", texel_);
  program.set("smallest_offset", smallest_offset_);
}

}  // namespace rebounce

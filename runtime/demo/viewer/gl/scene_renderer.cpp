#include "runtime/demo/viewer/gl/scene_renderer.h"

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "rebounce/error.h"
#include "runtime/demo/image/tone_curve.h"
#include "runtime/demo/viewer/gl/lamp_shader.h"
#include "runtime/demo/viewer/gl/shaders.h"
#include "runtime/demo/viewer/gl/sky_shader.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/sky_light.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr float kNearPart = 2e-4F;  // fraction of the scene's diagonal

// Cubes of many lamps are smaller: 64 take 100 MiB.
constexpr std::size_t kFewLamps = 8;
constexpr int kSideOfFew = 1024, kSideOfMany = 256;  // texels

glm::vec3 background(const FrameSettings& frame) {
  if (frame.show == Show::kPatches || frame.show == Show::kError) return glm::vec3(0.02F);
  if (frame.show == Show::kIndirect) return glm::vec3(0);
  return dimmed(to_glm(mean_sky_luminance(frame.sky)) * std::exp2(frame.exposure),
                kBrightestEmitter);
}

SceneBounds bounds_of(const DisplayMesh& mesh) {
  SceneBounds bounds{glm::vec3(std::numeric_limits<float>::max()),
                     glm::vec3(std::numeric_limits<float>::lowest())};
  for (const Float3& position : mesh.position) {
    bounds.low = glm::min(bounds.low, to_glm(position));
    bounds.high = glm::max(bounds.high, to_glm(position));
  }
  return bounds;
}

// World to clip space of `camera`, for a picture with this `aspect` (width / height).
glm::mat4 view_of(const Camera& camera, float aspect, const SceneBounds& bounds) {
  const glm::vec3 eye = to_glm(camera.position);
  const float reach = bounds.diagonal() + glm::distance(eye, 0.5F * (bounds.low + bounds.high));
  return glm::perspective(camera.vertical_fov, aspect, kNearPart * bounds.diagonal(), reach) *
         glm::lookAt(eye, eye - to_glm(camera.backward), to_glm(camera.up));
}

}  // namespace

SceneRenderer::SceneRenderer(const GpuScene& scene, const DisplayMesh& mesh,
                             std::span<const Light> emitter_lamps)
    : scene_(scene),
      bounds_(bounds_of(mesh)),
      emitter_lamps_(emitter_lamps),
      spheres_(scene),
      lamp_surfaces_(scene),
      no_bodies_(scene),
      ambient_(shaders::kSceneVertex, shaders::kAmbientFragment),
      lamp_(shaders::kSceneVertex, shaders::lamp_fragment().c_str()),
      patch_(shaders::kSceneVertex, shaders::kPatchFragment),
      shadow_(shaders::kShadowVertex, shaders::kShadowFragment),
      screen_(shaders::kScreenVertex, shaders::kScreenFragment),
      sky_(shaders::kScreenVertex, shaders::kSkyFragment) {
  glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
}

void SceneRenderer::set_bodies(BodyMesh spheres, bool keeps_places, std::span<const Light> lamps) {
  if (!keeps_places) ++spheres_version_;
  spheres_.upload(std::move(spheres));
  BodyMesh surfaces;
  for (const Light& lamp : lamps) add_lamp_surface(lamp, surfaces);
  lamp_surfaces_.upload(std::move(surfaces));
}

void SceneRenderer::update_shadows(std::span<const Light> lights, bool draws_emitter_lamps) {
  const auto update = [&](auto& maps, std::span<const Light> lamps, const ShadowCasters& casters) {
    const int side = lamps.size() > kFewLamps ? kSideOfMany : kSideOfFew;
    while (maps.size() < lamps.size()) maps.push_back(std::make_unique<ShadowMap>());
    maps.resize(lamps.size());
    for (std::size_t k = 0; k < lamps.size(); ++k) {
      maps[k]->update(lamps[k], casters, shadow_, side);
    }
  };
  update(shadow_maps_, lights, {scene_, spheres_, bounds_, spheres_version_});
  if (draws_emitter_lamps) update(emitter_maps_, emitter_lamps_, {scene_, no_bodies_, bounds_});
}

void SceneRenderer::draw(const FrameSettings& frame, GLuint framebuffer) {
  target_.resize(frame.width, frame.height);
  glBindFramebuffer(GL_FRAMEBUFFER, target_.framebuffer());
  glViewport(0, 0, frame.width, frame.height);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
  const glm::vec3 behind = background(frame);
  glClearColor(behind.r, behind.g, behind.b, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const glm::mat4 view = view_of(
      frame.camera, static_cast<float>(frame.width) / static_cast<float>(frame.height), bounds_);
  const bool patches = frame.show == Show::kPatches || frame.show == Show::kError;
  if (patches) {
    draw_patches(frame, view);
  } else {
    draw_sky(frame);
    draw_light(frame, view);
  }

  const GLuint light = target_.resolve();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  screen_.use();
  screen_.set("light", 0);
  screen_.set("display_referred", patches ? 1 : 0);
  screen_.set("height", frame.height);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, light);
  glBindVertexArray(empty_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  if (frame.split) draw_divider(frame);
}

int SceneRenderer::split_column(const FrameSettings& frame) const {
  return static_cast<int>(std::lround(*frame.split * static_cast<float>(frame.width)));
}

void SceneRenderer::draw_divider(const FrameSettings& frame) const {
  glEnable(GL_SCISSOR_TEST);
  glScissor(split_column(frame) - 1, 0, 2, frame.height);
  glClearColor(1, 1, 1, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  glDisable(GL_SCISSOR_TEST);
}

template <typename Draw>
void SceneRenderer::for_each_side(const FrameSettings& frame, const Draw& draw) const {
  if (!frame.split) {
    draw(Side::kFirst);
    return;
  }
  const int left = split_column(frame);
  glEnable(GL_SCISSOR_TEST);
  glScissor(0, 0, left, frame.height);
  draw(Side::kFirst);
  glScissor(left, 0, frame.width - left, frame.height);
  draw(Side::kSecond);
  glDisable(GL_SCISSOR_TEST);
}

void SceneRenderer::draw_sky(const FrameSettings& frame) const {
  if (!frame.sky.distribution || frame.show == Show::kIndirect) return;
  const Camera& camera = frame.camera;
  const float half_height = std::tan(0.5F * camera.vertical_fov);
  const glm::vec2 size(frame.width, frame.height);
  sky_.use();
  sky_.set("right", half_height * size.x / size.y * to_glm(camera.right));
  sky_.set("up", half_height * to_glm(camera.up));
  sky_.set("forward", -to_glm(camera.backward));
  sky_.set("picture_size", size);
  sky_.set("cell_part", std::span<const float>(*frame.sky.distribution));
  sky_.set("sky_luminance", to_glm(sky_luminance_unit(frame.sky)) * std::exp2(frame.exposure));
  sky_.set("brightest", kBrightestEmitter);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glBindVertexArray(empty_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
}

void SceneRenderer::draw_light(const FrameSettings& frame, const glm::mat4& view) {
  ambient_.use();
  ambient_.set("clip_from_world", view);
  ambient_.set("exposure_scale", std::exp2(frame.exposure));
  ambient_.set("first_part", frame.show == Show::kIndirect ? 0.0F : 1.0F);
  ambient_.set("bounced_part", frame.show == Show::kDirect ? 0.0F : 1.0F);
  ambient_.set("base_color_texture", 0);
  ambient_.set("emissive_texture", 1);
  for_each_side(frame, [&](Side side) {
    scene_.draw_materials(ambient_, side);
    spheres_.draw(ambient_, side);
  });
  if (frame.show == Show::kIndirect) return;
  draw_lamp_surfaces();

  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_EQUAL);
  lamp_.use();
  lamp_.set("clip_from_world", view);
  lamp_.set("exposure_scale", std::exp2(frame.exposure));
  lamp_.set("base_color_texture", 0);
  lamp_.set("eye", to_glm(frame.camera.position));
  for (std::size_t k = 0; k < frame.lights.size(); ++k) {
    set_lamp(frame.lights[k], *shadow_maps_[k]);
    scene_.draw_materials(lamp_, Side::kFirst);
    spheres_.draw(lamp_, Side::kFirst);
  }
  for (std::size_t k = 0; frame.draws_emitter_lamps && k < emitter_lamps_.size(); ++k) {
    set_lamp(emitter_lamps_[k], *emitter_maps_[k]);
    scene_.draw_materials(lamp_, Side::kFirst);
  }
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

void SceneRenderer::draw_lamp_surfaces() const {
  // Lamps may lie in the plane of a ceiling.
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(-2, -16);
  lamp_surfaces_.draw(ambient_, Side::kFirst);
  glDisable(GL_POLYGON_OFFSET_FILL);
}

void SceneRenderer::set_lamp(const Light& light, const ShadowMap& shadow) const {
  shadow.bind(lamp_);
  lamp_.set("lamp_type", static_cast<int>(light.type));
  lamp_.set("shadow_map", static_cast<int>(lamp_kind(light.type).shadow_map));
  lamp_.set("lamp_position", to_glm(light.position));
  lamp_.set("lamp_direction", to_glm(light.direction));
  lamp_.set("lamp_color", to_glm(light.color) * light.intensity);
  lamp_.set("lamp_range", light.range);
  lamp_.set("cos_inner", std::cos(light.inner_cone_angle));
  lamp_.set("cos_outer", std::cos(light.outer_cone_angle));
  if (lamp_kind(light.type).surface != nullptr) set_lamp_surface(PreparedLight(light));
}

void SceneRenderer::set_lamp_surface(const PreparedLight& lamp) const {
  lamp_.set("lamp_radius", lamp.radius);
  lamp_.set("lamp_side", lamp.side);
  lamp_.set("lamp_other_side", lamp.other_side);
  std::array<glm::vec3, kLampPlaceCount> places;
  for (std::uint32_t k = 0; k < kLampPlaceCount; ++k) {
    places[k] = lamp.kind->surface->place(lamp, k, kLampPlaceCount);
  }
  lamp_.set("lamp_places", std::span<const glm::vec3>(places));
  // Parts overlap, so that the edges of their shadows blend.
  constexpr float kOverlap = 1.5F;
  lamp_.set("place_reach", kOverlap * std::sqrt(lamp.area / (std::numbers::pi_v<float> *
                                                             static_cast<float>(places.size()))));
}

void SceneRenderer::draw_patches(const FrameSettings& frame, const glm::mat4& view) {
  patch_.use();
  patch_.set("clip_from_world", view);
  patch_.set("patch_of_triangle", 0);
  patch_.set("color_of_patch", 1);
  patch_.set("eye", to_glm(frame.camera.position));
  patch_.set("shading", frame.show == Show::kPatches ? 1.0F : 0.0F);
  patch_.set("shading_direction",
             0.6F * to_glm(frame.camera.backward) + 0.8F * to_glm(frame.camera.up));
  for_each_side(frame, [&](Side side) { scene_.draw_patches(patch_, side); });
}

}  // namespace rebounce

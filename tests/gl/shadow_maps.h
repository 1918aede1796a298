#pragma once

// What an engine does before it asks for direct light: depths of the scene from its lamps.

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <list>
#include <stdexcept>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// An empty texture of depths; without layers it has no storage.
class DepthTexture {
 public:
  explicit DepthTexture(GLenum target, GLsizei layers = 1) {
    glGenTextures(1, &name_);
    glBindTexture(target, name_);
    if (layers > 0 && target == GL_TEXTURE_2D_ARRAY) {
      glTexStorage3D(target, 1, GL_DEPTH_COMPONENT32F, 4, 4, layers);
    } else if (layers > 0) {
      glTexStorage2D(target, 1, GL_DEPTH_COMPONENT32F, 4, 4);
    }
    glBindTexture(target, 0);
  }
  ~DepthTexture() { glDeleteTextures(1, &name_); }
  DepthTexture(const DepthTexture&) = delete;
  DepthTexture& operator=(const DepthTexture&) = delete;

  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

/// Draws the surface of a scene into textures of depths. Needs a current context.
class ShadowMaps {
 public:
  explicit ShadowMaps(const TransferData& data) {
    std::vector<Uint3> triangles(
        data.mesh.triangle.begin(),
        data.mesh.triangle.begin() + static_cast<std::ptrdiff_t>(data.mesh.surface_count()));
    count_ = static_cast<GLsizei>(3 * triangles.size());
    low_ = glm::vec3(std::numeric_limits<float>::max());
    high_ = -low_;
    for (const Float3& position : data.mesh.position) {
      low_ = glm::min(low_, to_glm(position));
      high_ = glm::max(high_, to_glm(position));
    }
    glGenVertexArrays(1, &array_);
    glBindVertexArray(array_);
    glGenBuffers(2, buffers_.data());
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[0]);
    glBufferData(GL_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(data.mesh.position.size() * sizeof(Float3)),
                 data.mesh.position.data(), GL_STATIC_DRAW);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers_[1]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(triangles.size() * sizeof(Uint3)),
                 triangles.data(), GL_STATIC_DRAW);
    program_ = glCreateProgram();
    add_shader(GL_VERTEX_SHADER,
               "#version 430\nlayout(location = 0) in vec3 position; uniform mat4 matrix;"
               "void main() { gl_Position = matrix * vec4(position, 1); }");
    add_shader(GL_FRAGMENT_SHADER, "#version 430\nvoid main() {}");
    glLinkProgram(program_);
    glGenFramebuffers(1, &framebuffer_);
  }
  ~ShadowMaps() {
    glDeleteTextures(static_cast<GLsizei>(textures_.size()), textures_.data());
    glDeleteFramebuffers(1, &framebuffer_);
    glDeleteProgram(program_);
    glDeleteBuffers(2, buffers_.data());
    glDeleteVertexArrays(1, &array_);
  }
  ShadowMaps(const ShadowMaps&) = delete;
  ShadowMaps& operator=(const ShadowMaps&) = delete;

  float diagonal() const { return glm::distance(low_, high_); }

  /// A cube map around a lamp.
  GpuLamp cube(const Light& light, int side) {
    const GLuint texture = make_texture(GL_TEXTURE_CUBE_MAP, side, 1);
    for (GLuint face = 0; face < 6; ++face) {
      draw(side, false, face_matrix(light, face), [&] {
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT,
                               GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, texture, 0);
      });
    }
    return {.light = light,
            .shadow_map = GpuShadowMap::kCube,
            .texture = texture,
            .depth_range = {near_metres(), far_metres()}};
  }

  /// The same as six layers of one texture; `reversed`: depth 1 is the nearest.
  GpuLamp layers(const Light& light, int side, bool reversed) {
    const GLuint texture = make_texture(GL_TEXTURE_2D_ARRAY, side, 6);
    std::vector<GpuShadowView>& views = views_.emplace_back();
    for (GLuint face = 0; face < 6; ++face) {
      const glm::mat4 matrix = reverse(reversed) * face_matrix(light, face);
      draw(side, reversed, matrix, [&] {
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, texture, 0,
                                  static_cast<GLint>(face));
      });
      views.push_back(view_of(matrix, face));
    }
    return {
        .light = light, .shadow_map = GpuShadowMap::kLayers, .texture = texture, .views = views};
  }

  /// One plane: that of a spot, or of a directional light over the whole scene.
  GpuLamp plane(const Light& light, int side, bool reversed) {
    const GLuint texture = make_texture(GL_TEXTURE_2D, side, 1);
    const glm::mat4 matrix =
        reverse(reversed) *
        (light.type == LightType::kSpot ? spot_matrix(light) : sun_matrix(light));
    draw(side, reversed, matrix, [&] {
      glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture, 0);
    });
    views_.push_back({view_of(matrix, 0)});
    return {.light = light,
            .shadow_map = GpuShadowMap::kPlane,
            .texture = texture,
            .views = views_.back()};
  }

 private:
  float near_metres() const { return 2e-3F * diagonal(); }
  float far_metres() const { return 2 * diagonal(); }

  void add_shader(GLenum type, const char* text) const {
    const GLuint shader = glCreateShader(type);
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    glAttachShader(program_, shader);
    glDeleteShader(shader);
  }

  GLuint make_texture(GLenum target, int side, int layers) {
    GLuint& name = textures_.emplace_back();
    glGenTextures(1, &name);
    glBindTexture(target, name);
    if (target == GL_TEXTURE_2D_ARRAY) {
      glTexStorage3D(target, 1, GL_DEPTH_COMPONENT32F, side, side, layers);
    } else {
      glTexStorage2D(target, 1, GL_DEPTH_COMPONENT32F, side, side);
    }
    return name;
  }

  template <typename Attach>
  void draw(int side, bool reversed, const glm::mat4& matrix, const Attach& attach) const {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    attach();
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw std::runtime_error("a shadow map cannot be drawn");
    glViewport(0, 0, side, side);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(reversed ? GL_GREATER : GL_LESS);
    glClearDepth(reversed ? 0 : 1);
    glClear(GL_DEPTH_BUFFER_BIT);
    glUseProgram(program_);
    glUniformMatrix4fv(glGetUniformLocation(program_, "matrix"), 1, GL_FALSE,
                       glm::value_ptr(matrix));
    glBindVertexArray(array_);
    glDrawElements(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr);
  }

  static glm::mat4 reverse(bool reversed) {
    return glm::scale(glm::mat4(1), {1, 1, reversed ? -1 : 1});
  }

  static GpuShadowView view_of(const glm::mat4& clip_from_world, unsigned layer) {
    const glm::mat4 half =
        glm::translate(glm::mat4(1), glm::vec3(0.5F)) * glm::scale(glm::mat4(1), glm::vec3(0.5F));
    const glm::mat4 matrix = half * clip_from_world;
    GpuShadowView view{.layer = layer};
    std::copy_n(glm::value_ptr(matrix), 16, view.texture_from_world.begin());
    return view;
  }

  glm::mat4 face_matrix(const Light& light, GLuint face) const {
    static constexpr std::array<Float3, 6> kForward = {
        {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
    static constexpr std::array<Float3, 6> kUp = {
        {{0, -1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {0, -1, 0}, {0, -1, 0}}};
    const glm::vec3 eye = to_glm(light.position);
    return glm::perspective(glm::radians(90.0F), 1.0F, near_metres(), far_metres()) *
           glm::lookAt(eye, eye + to_glm(kForward[face]), to_glm(kUp[face]));
  }

  glm::mat4 spot_matrix(const Light& light) const {
    const glm::vec3 eye = to_glm(light.position), way = to_glm(light.direction);
    const glm::vec3 up = std::abs(way.y) < 0.9F ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    return glm::perspective(2 * light.outer_cone_angle + 0.02F, 1.0F, near_metres(), far_metres()) *
           glm::lookAt(eye, eye + way, up);
  }

  glm::mat4 sun_matrix(const Light& light) const {
    const glm::mat3 axes = glm::transpose(glm::mat3(frame_around(-to_dvec3(light.direction))));
    glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
    for (int k = 0; k < 8; ++k) {
      const glm::vec3 corner((k & 1) != 0 ? low_.x : high_.x, (k & 2) != 0 ? low_.y : high_.y,
                             (k & 4) != 0 ? low_.z : high_.z);
      low = glm::min(low, axes * corner);
      high = glm::max(high, axes * corner);
    }
    const float margin = 0.01F * diagonal();
    return glm::ortho(low.x - margin, high.x + margin, low.y - margin, high.y + margin,
                      -high.z - margin, -low.z + margin) *
           glm::mat4(axes);
  }

  GLuint array_ = 0, program_ = 0, framebuffer_ = 0;
  std::array<GLuint, 2> buffers_{};
  GLsizei count_ = 0;
  glm::vec3 low_, high_;
  std::vector<GLuint> textures_;
  std::list<std::vector<GpuShadowView>> views_;  // stay where they are
};

}  // namespace rebounce::test

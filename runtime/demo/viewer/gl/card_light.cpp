#include "runtime/demo/viewer/gl/card_light.h"

#define EGL_NO_X11
#include <EGL/egl.h>

#include <algorithm>

#include "runtime/demo/viewer/gl/vertex_layout.h"
#include "runtime/lights/lamp_kind.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {
namespace {

constexpr const char* kSubtract = R"(#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Emitted { float emitted[]; };
layout(std430, binding = 1) buffer Bounced { float bounced[]; };
void main() {
  uint k = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
  if (k < uint(emitted.length())) bounced[k] -= emitted[k];
}
)";
constexpr GLuint kGroupsInRow = 32768;

GlFunction find_function(const char* name) {
  return eglGetProcAddress(name);
}

}  // namespace

CardLight::CardLight(const std::shared_ptr<const TransferData>& data,
                     std::span<const glm::vec3> emitted_at_vertices)
    : engine_(data, find_function), value_count_(3 * emitted_at_vertices.size()) {
  engine_.measure_stages(true);
  const std::vector<Float3> dark(data->patches.size());
  fill<Float3>(GL_COPY_WRITE_BUFFER, direct_, dark, GL_STREAM_COPY);
  fill(GL_COPY_WRITE_BUFFER, emitted_, emitted_at_vertices, GL_STATIC_DRAW);
  const GLuint shader = glCreateShader(GL_COMPUTE_SHADER);
  glShaderSource(shader, 1, &kSubtract, nullptr);
  glCompileShader(shader);
  subtract_ = glCreateProgram();
  glAttachShader(subtract_, shader);
  glLinkProgram(subtract_);
  glDeleteShader(shader);
}

CardLight::~CardLight() {
  glDeleteProgram(subtract_);
}

bool CardLight::is_possible(const TransferData& data) {
  GLint major = 0, minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  return 10 * major + minor >= 43 && data.transfer->kind() == OperatorKind::kHierarchical;
}

bool CardLight::can_light(const Light& light) {
  return lamp_kind(light.type).surface == nullptr && !light.profile;
}

void CardLight::relight(std::span<const GpuLamp> lamps, std::span<const Float3> others,
                        GLuint bounced) {
  fill(GL_COPY_WRITE_BUFFER, others_, others, GL_STREAM_DRAW);
  engine_.light_patches(lamps, direct_.name(), others_.name());
  engine_.relight({.direct_irradiance = direct_.name(), .vertex_irradiance = bounced});
  if (value_count_ == 0) return;
  glUseProgram(subtract_);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, emitted_.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, bounced);
  const auto groups = static_cast<GLuint>((value_count_ + 63) / 64);
  glDispatchCompute(std::min(groups, kGroupsInRow), (groups + kGroupsInRow - 1) / kGroupsInRow, 1);
  glMemoryBarrier(GL_ALL_BARRIER_BITS);
}

}  // namespace rebounce

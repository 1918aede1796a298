#include "runtime/demo/viewer/gl/card_light.h"

#define EGL_NO_X11
#include <EGL/egl.h>

#include "runtime/demo/viewer/gl/vertex_layout.h"
#include "runtime/lights/lamp_kind.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {
namespace {

GlFunction find_function(const char* name) {
  return eglGetProcAddress(name);
}

}  // namespace

CardLight::CardLight(const std::shared_ptr<const TransferData>& data)
    : engine_(data, find_function) {
  engine_.measure_stages(true);
  const std::vector<Float3> dark(data->patches.size());
  engine_.set_emitted_exitance(dark);
  fill<Float3>(GL_COPY_WRITE_BUFFER, direct_, dark, GL_STREAM_COPY);
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
}

}  // namespace rebounce

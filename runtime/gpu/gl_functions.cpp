#include "runtime/gpu/gl_functions.h"

#include <string>

#include "rebounce/error.h"

namespace rebounce {
namespace {

template <typename Function>
void load(GlGetProcAddress get, const char* name, Function& function) {
  function = reinterpret_cast<Function>(get(name));  // NOLINT: OpenGL's way
  if (function == nullptr) {
    throw Unsupported(std::string("this context has no ") + name +
                      "; make one of OpenGL 4.3 or newer and make it current");
  }
}

}  // namespace

GlFunctions::GlFunctions(GlGetProcAddress get) {
  if (get == nullptr) throw Error("give the function that finds those of OpenGL");
  load(get, "glGetIntegerv", get_integer);
  load(get, "glGetString", get_string);
  const unsigned char* const version = get_string(Gl::kVersion);
  if (version == nullptr) throw Error("no OpenGL context is current on this thread");
  int major = 0, minor = 0;
  get_integer(Gl::kMajorVersion, &major);
  get_integer(Gl::kMinorVersion, &minor);
  const std::string name(reinterpret_cast<const char*>(version));
  if (10 * major + minor < 43 || name.starts_with("OpenGL ES")) {
    throw Unsupported("OpenGL 4.3 is needed; this context is " + name);
  }
  load(get, "glGetIntegeri_v", get_integer_at);
  load(get, "glGetInteger64v", get_long);
  load(get, "glGetInteger64i_v", get_long_at);
  load(get, "glGetError", get_error);
  load(get, "glGenBuffers", gen_buffers);
  load(get, "glDeleteBuffers", delete_buffers);
  load(get, "glIsBuffer", is_buffer);
  load(get, "glBindBuffer", bind_buffer);
  load(get, "glBindBufferBase", bind_buffer_base);
  load(get, "glBindBufferRange", bind_buffer_range);
  load(get, "glBufferData", buffer_data);
  load(get, "glBufferSubData", buffer_sub_data);
  load(get, "glGetBufferParameteri64v", get_buffer_long);
  load(get, "glActiveTexture", active_texture);
  load(get, "glBindTexture", bind_texture);
  load(get, "glIsTexture", is_texture);
  load(get, "glGetTexParameteriv", get_texture);
  load(get, "glGetTexLevelParameteriv", get_texture_level);
  load(get, "glGenSamplers", gen_samplers);
  load(get, "glDeleteSamplers", delete_samplers);
  load(get, "glBindSampler", bind_sampler);
  load(get, "glSamplerParameteri", set_sampler);
  load(get, "glGenQueries", gen_queries);
  load(get, "glDeleteQueries", delete_queries);
  load(get, "glQueryCounter", query_counter);
  load(get, "glGetQueryObjectui64v", get_query);
  load(get, "glCreateShader", create_shader);
  load(get, "glShaderSource", shader_source);
  load(get, "glCompileShader", compile_shader);
  load(get, "glGetShaderiv", get_shader);
  load(get, "glGetShaderInfoLog", get_shader_log);
  load(get, "glDeleteShader", delete_shader);
  load(get, "glCreateProgram", create_program);
  load(get, "glAttachShader", attach_shader);
  load(get, "glLinkProgram", link_program);
  load(get, "glGetProgramiv", get_program);
  load(get, "glGetProgramInfoLog", get_program_log);
  load(get, "glDeleteProgram", delete_program);
  load(get, "glUseProgram", use_program);
  load(get, "glDispatchCompute", dispatch_compute);
  load(get, "glMemoryBarrier", memory_barrier);
}

}  // namespace rebounce

#pragma once

#include <cstddef>
#include <cstdint>

#include "rebounce/engine.h"

namespace rebounce {

/// What the compute path needs of OpenGL 4.3, by the names and numbers of the Khronos registry.
/// Loaded from the caller's context, so that no library of OpenGL is linked.
struct GlFunctions {
#if defined(_WIN32) && !defined(_WIN64)
#error "32-bit Windows calls OpenGL by a convention that is not declared here"
#endif
  using Enum = unsigned int;

  /// Throws Unsupported if the context is not OpenGL 4.3 or newer, or lacks a function.
  explicit GlFunctions(GlGetProcAddress get_proc_address);

  void (*get_integer)(Enum name, int* value);
  void (*get_integer_at)(Enum name, unsigned index, int* value);
  void (*get_long)(Enum name, std::int64_t* value);
  void (*get_long_at)(Enum name, unsigned index, std::int64_t* value);
  const unsigned char* (*get_string)(Enum name);
  Enum (*get_error)();

  void (*gen_buffers)(int count, unsigned* names);
  void (*delete_buffers)(int count, const unsigned* names);
  unsigned char (*is_buffer)(unsigned name);
  void (*bind_buffer)(Enum target, unsigned name);
  void (*bind_buffer_base)(Enum target, unsigned index, unsigned name);
  void (*bind_buffer_range)(Enum target, unsigned index, unsigned name, std::ptrdiff_t begin,
                            std::ptrdiff_t size);
  void (*buffer_data)(Enum target, std::ptrdiff_t size, const void* data, Enum usage);
  void (*buffer_sub_data)(Enum target, std::ptrdiff_t begin, std::ptrdiff_t size, const void* data);
  void (*get_buffer_long)(Enum target, Enum name, std::int64_t* value);

  void (*active_texture)(Enum unit);
  void (*bind_texture)(Enum target, unsigned name);
  unsigned char (*is_texture)(unsigned name);
  void (*get_texture)(Enum target, Enum name, int* value);
  void (*get_texture_level)(Enum target, int level, Enum name, int* value);
  void (*gen_samplers)(int count, unsigned* names);
  void (*delete_samplers)(int count, const unsigned* names);
  void (*bind_sampler)(unsigned unit, unsigned name);
  void (*set_sampler)(unsigned name, Enum parameter, int value);

  void (*gen_queries)(int count, unsigned* names);
  void (*delete_queries)(int count, const unsigned* names);
  void (*query_counter)(unsigned name, Enum target);
  void (*get_query)(unsigned name, Enum parameter, std::uint64_t* value);

  unsigned (*create_shader)(Enum type);
  void (*shader_source)(unsigned shader, int count, const char* const* text, const int* length);
  void (*compile_shader)(unsigned shader);
  void (*get_shader)(unsigned shader, Enum name, int* value);
  void (*get_shader_log)(unsigned shader, int room, int* length, char* log);
  void (*delete_shader)(unsigned shader);
  unsigned (*create_program)();
  void (*attach_shader)(unsigned program, unsigned shader);
  void (*link_program)(unsigned program);
  void (*get_program)(unsigned program, Enum name, int* value);
  void (*get_program_log)(unsigned program, int room, int* length, char* log);
  void (*delete_program)(unsigned program);
  void (*use_program)(unsigned program);

  void (*dispatch_compute)(unsigned x, unsigned y, unsigned z);
  void (*memory_barrier)(unsigned bits);
};

/// The numbers of the Khronos registry that go with them.
struct Gl {
  static constexpr GlFunctions::Enum kMajorVersion = 0x821B, kMinorVersion = 0x821C,
                                     kVersion = 0x1F02, kOutOfMemory = 0x0505,
                                     kCurrentProgram = 0x8B8D;
  static constexpr GlFunctions::Enum kStorageBuffer = 0x90D2, kStorageBinding = 0x90D3,
                                     kStorageStart = 0x90D4, kStorageSize = 0x90D5,
                                     kMostStorageBytes = 0x90DE;
  static constexpr GlFunctions::Enum kUniformBuffer = 0x8A11, kUniformBinding = 0x8A28,
                                     kUniformStart = 0x8A29, kUniformSize = 0x8A2A;
  static constexpr GlFunctions::Enum kBufferSize = 0x8764, kStaticDraw = 0x88E4;
  static constexpr GlFunctions::Enum kComputeShader = 0x91B9, kCompileStatus = 0x8B81,
                                     kLinkStatus = 0x8B82, kInfoLogLength = 0x8B84;
  static constexpr GlFunctions::Enum kTexture0 = 0x84C0, kActiveTexture = 0x84E0,
                                     kSamplerBinding = 0x8919;
  static constexpr GlFunctions::Enum kTexture2D = 0x0DE1, kTexture2DBinding = 0x8069,
                                     kTextureArray = 0x8C1A, kTextureArrayBinding = 0x8C1D,
                                     kTextureCube = 0x8513, kTextureCubeBinding = 0x8514,
                                     kFirstCubeFace = 0x8515;
  static constexpr GlFunctions::Enum kBaseLevel = 0x813C, kLayerCount = 0x8071, kDepthBits = 0x884A;
  static constexpr GlFunctions::Enum kMinFilter = 0x2801, kMagFilter = 0x2800, kLinear = 0x2601,
                                     kWrapS = 0x2802, kWrapT = 0x2803, kClampToEdge = 0x812F,
                                     kCompareMode = 0x884C, kCompareToTexture = 0x884E,
                                     kCompareFunction = 0x884D, kLessOrEqual = 0x0203,
                                     kGreaterOrEqual = 0x0206;
  static constexpr GlFunctions::Enum kTimestamp = 0x8E28, kQueryResult = 0x8866;
  static constexpr GlFunctions::Enum kStreamDraw = 0x88E0;
  static constexpr unsigned kStorageBarrier = 0x2000, kAllBarriers = 0xFFFFFFFF;
};

}  // namespace rebounce

#pragma once

namespace rebounce {

/// The text of the shaders in runtime/gpu/shaders, which the build puts into the library.
struct ShaderSources {
  static const char* const kDirectLight;
  static const char* const kInitialExitance;
  static const char* const kProject;
  static const char* const kCouple;
  static const char* const kExpand;
  static const char* const kRadiosity;
  static const char* const kSetLight;
  static const char* const kReceiverRows;
  static const char* const kVertexIrradiance;
  static const char* const kLightmapIrradiance;
  static const char* const kProbeLight;
};

}  // namespace rebounce

#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/demo/motion/indirect_solver.h"
#include "runtime/demo/motion/light_motion.h"
#include "runtime/demo/picture/picture.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A lamp of the viewer.
struct ViewerLight {
  Light light;
  LightMotion motion{};
  bool on = true;
};

/// A sphere that moves through the scene. Light probes light it, and lamps with shadows. It does
/// not change the radiosity of the patches.
struct ViewerSphere {
  Float3 position{0, 0, 0};  ///< metres, the centre
  float radius = 0.1F;       ///< metres, > 0
  Float3 reflectance{0.7F, 0.7F, 0.7F};
  LightMotion motion{};
  bool on = true;
};

/// The initial state of the viewer; the panels can change all of it.
struct ViewerSetup {
  std::string title = "Rebounce";
  int width = 1280;  ///< pixels
  int height = 800;  ///< pixels
  std::vector<ViewerLight> lights{};
  std::vector<ViewerSphere> spheres{};
  Sky sky{};
  Camera camera;
  Show show = Show::kRadiosity;
  std::optional<float> exposure{};  ///< stops; unset: computed from a picture of the first frame
  /// How the two sides of a split screen compute their indirect light. Without a split only the
  /// first is used.
  std::array<IndirectMethod, 2> methods{};
  std::optional<float> split{};  ///< fraction of the width, 0 to 1, that shows the first method
  bool panels = false;           ///< pictures without a window show the panels too
  /// Returns the exact indirect irradiance [n] in lx for an initial exitance [n] in lx. Without it
  /// there are no errors to show.
  std::function<std::vector<Float3>(std::span<const Float3>)> reference{};
  /// Computes light probes when the first sphere needs them and the file has none. Without it only
  /// lamps light such spheres.
  std::function<LightProbes()> make_probes{};
};

/// The microseconds of the stages of a frame.
struct StageTimes {
  double direct = 0;                 ///< direct light of the patches, with shadow rays
  std::array<double, 2> solve = {};  ///< indirect light of each side
  double upload = 0;                 ///< to the vertices, and to the graphics card
  double shadows = 0;                ///< shadow maps
  double draw = 0;                   ///< the picture
  std::vector<GpuStageTime> card{};  ///< a frame on the graphics card, by its own clock
};

}  // namespace rebounce

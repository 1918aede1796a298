#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

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

/// A sphere that moves through the scene, lit by the light probes, and by lamps with shadows. Light
/// that it reflects or holds off does not go into the radiosity of the patches.
struct ViewerSphere {
  Float3 position{0, 0, 0};  ///< metres, the middle
  float radius = 0.1F;       ///< metres, > 0
  Float3 reflectance{0.7F, 0.7F, 0.7F};
  LightMotion motion{};
  bool on = true;
};

/// What the viewer begins with; all of it can be changed in its panels.
struct ViewerSetup {
  std::string title = "Rebounce";
  int width = 1280;  ///< pixels
  int height = 800;  ///< pixels
  std::vector<ViewerLight> lights{};
  std::vector<ViewerSphere> spheres{};
  Sky sky{};
  Camera camera;
  Show show = Show::kRadiosity;
  std::optional<float> exposure;  ///< stops; unset: found from a picture of the first frame
  /// How the two sides of a split screen find their indirect light; without a split the first
  /// counts.
  std::array<IndirectMethod, 2> methods{};
  std::optional<float> split{};  ///< part of the width, 0 to 1, that shows the first method
  bool panels = false;           ///< pictures without a window show the panels too
  /// Gives the exact indirect irradiance [n] in lx for an initial exitance [n] in lx; without it
  /// there is no error to show.
  std::function<std::vector<Float3>(std::span<const Float3>)> reference{};
  /// Finds light probes for a file that has none, when the first sphere needs them; without it such
  /// spheres are lit by lamps alone.
  std::function<LightProbes()> make_probes{};
};

/// Microseconds that the stages of a frame took.
struct StageTimes {
  double direct = 0;                 ///< direct light of the patches, with shadow rays
  std::array<double, 2> solve = {};  ///< indirect light of each side
  double upload = 0;                 ///< to the vertices, and to the graphics card
  double shadows = 0;                ///< shadow maps
  double draw = 0;                   ///< the picture
};

}  // namespace rebounce

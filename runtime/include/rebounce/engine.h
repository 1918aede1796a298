#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/lights.h"
#include "rebounce/scene_data.h"
#include "rebounce/scheduler.h"
#include "rebounce/sky.h"
#include "rebounce/transfer_file.h"
#include "rebounce/types.h"

namespace rebounce {

struct DirectLightingSettings {
  /// Points of a patch at which lamps are looked at. More: softer, truer shadow borders; time grows
  /// in proportion. At least 1.
  int points_per_patch = 8;
  /// Places of a lamp with a surface that each point looks at, from 1 to 64. More: smoother half
  /// shadows; time of such lamps grows in proportion.
  int area_light_samples = 4;
  /// Lights for which room is made at once. Each takes 4 bytes per patch, and 320 for each flat
  /// piece of surface that hides light. A frame that has more makes the room it lacks, the only
  /// time that one allocates. At least 0.
  int light_capacity = 16;
};

/// A point of a patch at which its direct light is looked for.
struct ReceiverPoint {
  Float3 position{0, 0, 0};  ///< metres, off the surface by no more than rounding needs
  Float3 normal{0, 0, 0};    ///< unit, of the flat triangle that it lies on
};

/// The points [n][points_per_patch] at which an engine of these settings looks at its lamps: the
/// direct irradiance of a patch is the mean of the irradiances at its points. Renderers that find
/// it themselves, with shadow maps for instance, look there too: a centroid may lie off its patch,
/// and is either in shadow or not. Throws Error if points_per_patch is below 1.
std::vector<ReceiverPoint> receiver_points(const TransferData& data,
                                           const DirectLightingSettings& settings = {});

struct EngineSettings {
  DirectLightingSettings direct_lighting{};  ///< of no use where the caller brings the direct light
  Scheduler scheduler{};                     ///< where frames run; copies of the engine use it too
};

/// Relights one scene: direct light, then one product with the stored operator.
///
/// The operator may have receivers and sources (patch_roles). Patches that are no receivers then
/// have an indirect irradiance of 0, and their radiosity is their initial exitance. Light on
/// patches that are no sources is shown as direct light and never bounces.
///
/// The transfer data are read only and may be shared by any number of engines. An engine is one
/// light state and belongs to one thread at a time: a frame that begins during another one throws
/// Error. A copy shares the data, the ray tracer and the points of the patches, and has a light
/// state of its own, for another thread. After construction nothing allocates, locks, prints or
/// touches a file, but see DirectLightingSettings::light_capacity. An engine that was moved from
/// may only be destroyed.
class Engine {
 public:
  /// Makes room for everything a frame needs. Throws Error if `data` is null or has no operator, or
  /// a setting is out of range.
  explicit Engine(std::shared_ptr<const TransferData> data, const EngineSettings& settings = {});
  ~Engine();
  Engine(const Engine& other);
  Engine(Engine&& other) noexcept;
  Engine& operator=(const Engine&) = delete;
  Engine& operator=(Engine&& other) noexcept;

  /// One frame: finds the direct irradiance of the patches under `lights` and `sky`, and with it
  /// all that follows. Lights are known by their number: keep their order, so that only those that
  /// moved or changed shape are traced again. Throws Error if a field of a light that its type
  /// uses, or its position, colour, intensity or range, is out of range, with the light's number,
  /// if a number of the sky is negative or not finite, if the sky has a distribution and the data
  /// do not say how much of its cells is seen, or if more than 1e30 lx arrive at a patch, with its
  /// index. The last frame then stays.
  void relight(std::span<const Light> lights, const Sky& sky);

  /// One frame with a direct irradiance [n] in lx that the caller brings, from shadow maps for
  /// instance; its sky is dark. Throws Error if the size is wrong or a number is negative, not
  /// finite or above 1e30, with the index of the patch; the last frame then stays.
  void relight(std::span<const Float3> direct_irradiance);

  /// From the next frame on, what the surfaces of material `material` emit is that of the scene
  /// times `scale`, each channel >= 0. Throws Error if there is no such material, `scale` is
  /// negative or not finite, or a patch would emit more than 1e30 lx. A patch of several materials
  /// follows the one that emits from most of it.
  void set_emission_scale(std::uint32_t material, const Float3& scale);

  // Results, [n] in lx; valid until the next frame.
  std::span<const Float3> direct_irradiance() const;
  std::span<const Float3> initial_exitance() const;
  std::span<const Float3> indirect_irradiance() const;
  std::span<const Float3> radiosity() const;
  /// What the patches emit at present.
  std::span<const Float3> emitted_exitance() const;

  /// The sky of the last frame.
  const Sky& sky() const;
  /// Where frames run, and the outputs of them (outputs.h).
  const Scheduler& scheduler() const;

  const TransferData& data() const;
  const std::shared_ptr<const TransferData>& shared_data() const;

  /// The library's own.
  struct Parts;
  Parts& parts() { return *parts_; }
  const Parts& parts() const { return *parts_; }

 private:
  std::unique_ptr<Parts> parts_;
};

/// Finds a function of OpenGL by its name, null if there is none: glfwGetProcAddress and
/// eglGetProcAddress are of this type.
using GlFunction = void (*)();
using GlGetProcAddress = GlFunction (*)(const char* name);

/// Names of OpenGL buffers of the caller's, each of floats [entries][3], in lx if nothing else is
/// said. All are different.
struct GpuBuffers {
  unsigned direct_irradiance = 0;    ///< [n] in
  unsigned indirect_irradiance = 0;  ///< [n] out; 0: not wanted
  unsigned radiosity = 0;            ///< [n] out; 0: not wanted
  unsigned vertex_irradiance = 0;    ///< [v] out, indirect, at least 0; 0: not wanted
  /// [height][width] out, indirect, at least 0; 0: not wanted. Needs a file made with --lightmap.
  unsigned lightmap_irradiance = 0;
  /// [p][9] out, cd/m², as QuadraticProbeLight (outputs.h); 0: not wanted. Needs a file made with
  /// --probes.
  unsigned probe_light = 0;
};

/// The kind of texture that a shadow map is in.
enum class GpuShadowMap : std::uint8_t { kNoShadow, kPlane, kLayers, kCube };

/// A part of what a lamp sees, drawn with one matrix.
struct GpuShadowView {
  /// Columns of the matrix that takes (x, y, z, 1) in metres to (u, v, depth, 1) times a positive
  /// number; inside of the view u, v and depth are from 0 to 1. Depth may grow or fall with the
  /// distance, the same way in all views of a lamp.
  std::array<float, 16> texture_from_world{};
  unsigned layer = 0;  ///< of a texture of layers
};

/// A lamp whose shadows are in a texture of depths of the caller's.
struct GpuLamp {
  static constexpr std::size_t kMostViews = 8;

  Light light;  ///< point, spot or directional, without a profile
  GpuShadowMap shadow_map = GpuShadowMap::kNoShadow;  ///< kNoShadow: it casts no shadows
  unsigned texture = 0;                               ///< 2D, 2D array or cube map
  /// Of planes and layers, from 1 to 8: a spot has one, a point six, a sun its cascades. A point
  /// takes the first view that has it, and is lit if none has.
  std::span<const GpuShadowView> views{};
  /// Of cubes around the lamp, faces as those of OpenGL: metres at which depth is 0 and 1, along
  /// the axis of the face. Either may be infinite, and the first may be the larger.
  Float2 depth_range{0.05F, 100};
};

/// Microseconds that a stage of the last frame took on the card.
struct GpuStageTime {
  const char* name;
  double microseconds;
};

/// Frames on the graphics card, by compute shaders of OpenGL 4.3: from lamps with shadow maps, or a
/// direct irradiance in a buffer, to the indirect irradiance, the radiosity and the light at
/// vertices, texels and probes in buffers. Nothing is read back. An Engine is the reference:
/// results differ by rounding, a few thousandths of the mean light at most, most of it that of the
/// Engine, which rounds light to integers. Two frames with the same light give the same bits on one
/// card and driver.
///
/// All calls, destruction too, are made with the same context, or one that shares its objects
/// (measure_stages takes one alone), current on the calling thread. They leave the program and all
/// bindings of the context as they were.
class GpuEngine {
 public:
  /// Compiles the shaders and takes the operator and the points of patches to the card; it shares
  /// the data. Errors that the context holds are dropped. Throws Error if `data` is null, if its
  /// operator is not hierarchical, if the card has no room for it, if points_per_patch is below 1,
  /// or with the compiler's log if a shader is refused; Unsupported if the context is not OpenGL
  /// 4.3 or newer.
  GpuEngine(const std::shared_ptr<const TransferData>& data, GlGetProcAddress get_proc_address,
            const DirectLightingSettings& settings = {});
  ~GpuEngine();
  GpuEngine(GpuEngine&& other) noexcept;
  GpuEngine& operator=(GpuEngine&& other) noexcept;

  /// Bytes of memory on the card.
  std::size_t bytes() const;

  /// From the next frame on, what the patches emit [n] in lx, that of an Engine for instance; at
  /// first that of the scene. Throws Error if the size is wrong or a number is negative or not
  /// finite.
  void set_emitted_exitance(std::span<const Float3> emitted_exitance);

  /// From the next frame on, the sky that probes see, found on the processor; at first it is dark.
  /// Throws Error if a number of it is negative or not finite, or it has a distribution and the
  /// file has no sky cells.
  void set_sky(const Sky& sky);

  /// Writes the direct irradiance [n] in lx to the buffer of this name: what the buffer `others`
  /// has (0: nothing), lamps with a surface and skies for instance, and the light of `lamps` at
  /// receiver_points(). The shadow maps are complete; shaders that write the others and read the
  /// result need no barrier. Texels of the shadow maps are taken four at a time, for points that
  /// are two texels off their surface. Throws Error with the lamp's number if a field is out of
  /// range, its type has no shadow map, its texture is not what it says or has no storage for
  /// depths, or a view is in a layer that the texture has not; if a buffer does not exist, is too
  /// small or is given twice; nothing is done then.
  void light_patches(std::span<const GpuLamp> lamps, unsigned direct_irradiance,
                     unsigned others = 0);

  /// Hands one frame to the card, and waits for nothing. Shaders that write the direct irradiance
  /// before and read results afterwards need no barrier. The direct irradiance is not looked at:
  /// what is negative or not finite spreads. Throws Error if a buffer does not exist, is too small
  /// or is given twice, or if the file has not what it needs; nothing is done then.
  void relight(const GpuBuffers& buffers);

  /// From now on, whether the times of stages are measured; at first they are not. While they are,
  /// all calls, measure_stages(false) and destruction too, are made with the context that was
  /// current when it began, since contexts do not share queries of time.
  void measure_stages(bool measure);
  /// Those of the last light_patches and relight, in their order, by time stamps, without those
  /// that had nothing to do; waits for the card.
  std::vector<GpuStageTime> stage_times() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace rebounce

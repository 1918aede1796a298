#pragma once

// What a renderer needs of the scene besides its geometry: materials, textures, cameras, lights.
// Shared by the importer (which fills it), the transfer file (which stores it) and the runtime.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "transfer/base/types.h"
#include "transfer/data/intensity_profile.h"
#include "transfer/data/sky_cells.h"

namespace rebounce {

enum class LightType : std::uint8_t { kPoint, kSpot, kDirectional, kSphere, kRectangle, kDisc };

/// A lamp in the world. Points, spots and directional lights have the fields and units of
/// KHR_lights_punctual; spheres, rectangles and discs shine with the same luminance from all of
/// their surface.
struct Light {
  LightType type = LightType::kPoint;
  std::string name;
  Float3 position{0, 0, 0};  ///< metres, the middle; not used by directional lights
  Float3 direction{0, -1,
                   0};  ///< unit; the way the light travels; the side of a rectangle or
                        ///< disc that shines; not used by spheres, and by points without a profile
  Float3 color{1, 1, 1};  ///< linear Rec.709, each >= 0
  float intensity = 1;    ///< >= 0; candela (point, spot), lux (directional), candela per m²
                          ///< (sphere, rectangle, disc); with a profile a factor of its candelas
  float range = 0;        ///< metres; beyond it no light arrives; 0 means unlimited
  float inner_cone_angle = 0;             ///< radians from the axis: full intensity inside (spot)
  float outer_cone_angle = 0.785398163F;  ///< radians from the axis: none outside (spot)
  float radius = 0;                       ///< metres, > 0 (sphere, disc)
  Float2 size{0, 0};                      ///< metres, > 0: along `tangent`, across it (rectangle)
  /// Not along `direction`, of which it is made perpendicular: the first side of a rectangle, and
  /// where the horizontal angles of a profile begin.
  Float3 tangent{1, 0, 0};
  std::shared_ptr<const IntensityProfile> profile;  ///< of a luminaire (point, spot); may be null
};

/// What is seen in every direction in which nothing is hit.
struct Sky {
  Float3 color{1, 1, 1};
  float luminance = 0;  ///< cd/m², >= 0
  /// Each >= 0: the luminance of each cell in parts of `luminance`; null: the same in all
  /// directions.
  std::shared_ptr<const SkyDistribution> distribution{};
};

/// A perspective camera placed in the world. `right`, `up` and `backward` are orthonormal.
struct Camera {
  std::string name;
  Float3 position{0, 0, 0};
  Float3 right{1, 0, 0};
  Float3 up{0, 1, 0};
  Float3 backward{0, 0, 1};   ///< the camera looks along -backward, as in glTF
  float vertical_fov = 0.8F;  ///< radians
};

enum class TextureWrap : std::uint8_t { kRepeat, kClampToEdge, kMirroredRepeat };

/// An image in its encoded form (PNG or JPEG bytes), as the asset carries it where it can be.
struct Texture {
  std::vector<std::uint8_t> encoded;
  TextureWrap wrap_s = TextureWrap::kRepeat;
  TextureWrap wrap_t = TextureWrap::kRepeat;
};

/// What a material's opacity means, as glTF's alphaMode.
enum class AlphaMode : std::uint8_t {
  kOpaque,  ///< the opacity is not looked at
  kMask,    ///< there where the opacity is at least the cutoff, a hole elsewhere
  kBlend,   ///< lets 1 - opacity through
};

struct Material {
  std::string name;
  Float3 base_color{1, 1, 1};         ///< linear; multiplies texture and vertex colour
  Float3 emitted_luminance{0, 0, 0};  ///< cd/m² (nit): emissiveFactor x emissiveStrength
  std::uint32_t base_color_texture = kNone;
  std::uint32_t emissive_texture = kNone;
  bool double_sided = false;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5F;  ///< >= 0; used by kMask
  float base_alpha = 1;       ///< [0, 1]; multiplies the alpha of the base colour's texture
  float transmission = 0;     ///< [0, 1], KHR_materials_transmission: passes through unscattered
};

}  // namespace rebounce

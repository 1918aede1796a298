#pragma once

// What lies in the shadow of flat pieces of surface, by planes instead of rays: shadow volumes
// (F. Crow, "Shadow algorithms for computer graphics", 1977), and for lamps with a surface volumes
// around their umbra and penumbra (T. Nishita, E. Nakamae, "Continuous tone representation of
// three-dimensional objects taking account of shadows and interreflection", 1985).

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/box.h"
#include "runtime/rays/occluders.h"

namespace rebounce {

/// Occluders by coordinates, so that loops over them are vectorised. Lanes without an occluder stop
/// nothing.
struct OccluderGroup {
  static constexpr std::size_t kLanes = 8, kCorners = Occluder::kCorners;
  using Lanes = std::array<float, kLanes>;
  using Vectors = std::array<Lanes, 3>;
  std::array<Vectors, kCorners> corner{};
  /// Unit, in the plane, perpendicular to the side from a corner to the next; 0 if it has no length.
  std::array<Vectors, kCorners> inward{};
  Vectors normal{};
  std::array<bool, kLanes> solid{};
};

std::vector<OccluderGroup> in_groups(std::span<const Occluder> occluders);

/// What occluders hide of one lamp.
class ShadowVolumes {
 public:
  using Number = std::uint32_t;  ///< of an occluder
  /// A point p is on the inner side of a plane if dot(normal, p) >= distance.
  struct Plane {
    glm::vec3 normal;  ///< unit, or 0
    float distance;
  };
  /// Those through the sides of an occluder, and that of itself.
  static constexpr std::size_t kPlanes = Occluder::kCorners + 1;
  using Planes = std::array<Plane, kPlanes>;

  explicit ShadowVolumes(std::size_t group_count) : outer_(group_count), inner_(group_count) {}

  /// Computes the volumes of `lamp`. Does not allocate. `groups`: as many as the object has;
  /// `tolerance`, metres: what a lamp may reach behind a plane and count as in front of it.
  void set(const PreparedLight& lamp, std::span<const OccluderGroup> groups, float tolerance);

  /// Occluders that stand between the lamp and something.
  struct Between {
    std::span<const Number> number;
    bool hidden = false;  ///< one of them hides all of the lamp from everywhere in it
    bool all = true;      ///< false: there was no room for more
  };
  /// Those that may hide something of the lamp from somewhere in `box`, written to `room`.
  Between between(const Box& box, std::span<Number> room) const;
  Between between(const Box& box, std::span<const Number> among, std::span<Number> room) const;

  /// Nothing outside of them is in the shadow. Of a lamp without a surface, all inside is.
  Planes outer(Number number) const { return planes(outer_, number); }
  /// All inside of them is wholly in the shadow.
  Planes inner(Number number) const { return planes(inner_, number); }

  /// False if light may get through the occluder or past it on both sides.
  bool is_certain(Number number) const;

 private:
  struct Group {
    std::array<OccluderGroup::Vectors, kPlanes> normal;
    std::array<OccluderGroup::Lanes, kPlanes> distance;
  };
  struct Lamp;

  void set_plane(const Lamp& lamp, const OccluderGroup& group, std::size_t g);
  static void set_side(const Lamp& lamp, const OccluderGroup& group, std::size_t side, Group& outer,
                       Group& inner);
  static Planes planes(const std::vector<Group>& groups, Number number);

  std::vector<Group> outer_, inner_;
};

}  // namespace rebounce

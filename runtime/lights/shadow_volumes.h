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
#include "runtime/lights/shadow_kernels.h"
#include "runtime/rays/box.h"
#include "runtime/rays/occluders.h"

namespace rebounce {

/// Occluders by coordinates, so that loops over them are vectorised. Lanes without an occluder stop
/// nothing.
struct OccluderGroup {
  static constexpr std::size_t kLanes = PlaneLanes::kLanes, kCorners = Occluder::kCorners;
  using Lanes = std::array<float, kLanes>;
  using Vectors = std::array<Lanes, 3>;
  std::array<Vectors, kCorners> corner{};
  /// Unit, in the plane, perpendicular to the side from a corner to the next; 0 if it has no
  /// length.
  std::array<Vectors, kCorners> inward{};
  Vectors normal{};
  std::array<bool, kLanes> solid{};
};

struct OccluderGroups {
  std::vector<OccluderGroup> group;
  bool is_whole;  ///< see Occluders

  explicit OccluderGroups(const Occluders& occluders);
};

/// What occluders hide of one lamp.
class ShadowVolumes {
 public:
  using Number = std::uint32_t;  ///< of an occluder

  explicit ShadowVolumes(std::size_t group_count) : outer_(group_count), inner_(group_count) {}

  /// Computes the volumes of `lamp`. Does not allocate. `groups`: as many as the object has;
  /// `tolerance`, metres: what a lamp may reach behind a plane and count as in front of it.
  void set(const PreparedLight& lamp, std::span<const OccluderGroup> groups, float tolerance);

  /// What stands between the lamp and a box.
  enum class Between : std::uint8_t {
    kSome,    ///< what was written down
    kHidden,  ///< something that hides all of the lamp from everywhere in it
    kMany,    ///< more than there was room for
  };
  /// Writes down the groups of which an occluder may hide something of the lamp from somewhere in
  /// `box`, and counts them.
  Between groups_between(const Box& box, std::span<Number> room, std::size_t& count) const;
  /// The same for occluders, of those in `groups`.
  Between between(const Box& box, std::span<const Number> groups, std::span<Number> room,
                  std::size_t& count) const;

  /// Nothing outside of it is in the shadow. Of a lamp without a surface, all inside is.
  VolumePlanes outer(Number number) const { return planes(outer_, number); }
  /// All inside of it is wholly in the shadow.
  VolumePlanes inner(Number number) const { return planes(inner_, number); }

  /// False if light may get through the occluder or past it on both sides.
  bool is_certain(Number number) const;

 private:
  struct Group {
    PlaneLanes plane[VolumePlanes::kPlanes];  ///< those of the sides, and the occluder's own
  };
  struct Lamp;

  void set_plane(const Lamp& lamp, const OccluderGroup& group, std::size_t g);
  static void set_side(const Lamp& lamp, const OccluderGroup& group, std::size_t side,
                       PlaneLanes& outer, PlaneLanes& inner);
  static VolumePlanes planes(const std::vector<Group>& groups, Number number);
  template <typename Visit>
  Between visit_between(const Box& box, Number group, const Visit& visit) const;

  std::vector<Group> outer_, inner_;
};

}  // namespace rebounce

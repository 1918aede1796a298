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
  /// [occluders] planes through the sides, with the occluder on their inner side, and its own.
  std::vector<VolumePlanes> piece;
  bool is_whole;  ///< see Occluders

  explicit OccluderGroups(const Occluders& occluders);

  /// False if light may get through.
  bool is_solid(std::size_t occluder) const {
    return group[occluder / OccluderGroup::kLanes].solid[occluder % OccluderGroup::kLanes];
  }
};

/// What occluders hide of one lamp.
class ShadowVolumes {
 public:
  using Number = VolumeNumber;  ///< of an occluder

  explicit ShadowVolumes(std::size_t group_count)
      : outer_(group_count),
        inner_(group_count),
        outer_planes_(group_count * OccluderGroup::kLanes),
        inner_planes_(outer_planes_.size()) {}

  /// Computes the volumes of `lamp`. Does not allocate. `groups`: as many as the object has;
  /// `tolerance`, metres: what a lamp with a place may reach behind a plane and count as in front
  /// of it.
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

  /// [occluders] Nothing outside of one is in the shadow. Of a lamp without a surface, all inside
  /// is.
  std::span<const VolumePlanes> outer() const { return outer_planes_; }
  /// [occluders] All inside of one is wholly in the shadow.
  std::span<const VolumePlanes> inner() const { return inner_planes_; }

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
  static void spread(const Group& group, VolumePlanes* volume);
  template <typename Visit>
  Between visit_between(const Box& box, Number group, const Visit& visit) const;

  std::vector<Group> outer_, inner_;
  std::vector<VolumePlanes> outer_planes_, inner_planes_;  ///< the same, volume by volume
};

}  // namespace rebounce

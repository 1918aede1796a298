#pragma once

#include <string>
#include <vector>

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// What the lamps of a scene do from frame to frame, 60 frames a second.
struct LightPath {
  std::string name;
  std::vector<std::vector<Light>> frames{};  ///< the lamps of each, always as many
  std::vector<int> switches{};               ///< frames in which a lamp goes on or off
};

/// A slow and a fast walk (0.1 and 1 % of the scene's diagonal a frame) from place to place in free
/// space, a swinging lamp (two seconds there and back), a lamp switched every half second beside
/// one of a twentieth that stays, a lamp whose colour goes round in five seconds beside a white
/// one, and sixteen lamps of all types of kLampTypes that swing at paces of their own. The same
/// `seed`, the same paths. Throws Error if no lamp lights much of the scene.
std::vector<LightPath> make_light_paths(const TransferData& data, const RayTracer& tracer,
                                        int frame_count, std::uint64_t seed);

}  // namespace rebounce::bench

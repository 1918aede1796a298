#pragma once

namespace rebounce {

struct DirectLightingSettings {
  /// Points of a patch at which lamps are looked at. More: softer, truer shadow borders; time grows
  /// in proportion. At least 1.
  int points_per_patch = 8;
  /// Places of a lamp with a surface that each point looks at, from 1 to 64. More: smoother half
  /// shadows; time of such lamps grows in proportion.
  int area_light_samples = 4;
  /// Lights for which room is made at once: 5 bytes per patch and light. A frame that has more
  /// makes the room it lacks, the only time that one allocates. At least 0.
  int light_capacity = 16;
};

}  // namespace rebounce

#include "precompute/patches/welded_positions.h"

#include <bit>

namespace rebounce {

WeldedPositions weld_positions(std::span<const Float3> position) {
  const auto hash = [](const Float3& p) {
    std::uint64_t bits = 0;
    for (const float x : p) {
      // Adding zero makes -0 and +0 equal.
      bits = (bits ^ std::bit_cast<std::uint32_t>(x + 0.0F)) * 0x9E3779B97F4A7C15ULL;
      bits ^= bits >> 29;
    }
    return bits;
  };
  // A hash table of vertices by position, with linear probing.
  std::vector<std::uint32_t> table(std::bit_ceil(position.size() + position.size() / 2 + 1), kNone);
  WeldedPositions welded;
  welded.id.reserve(position.size());
  for (std::uint32_t v = 0; v < position.size(); ++v) {
    std::size_t place = hash(position[v]) & (table.size() - 1);
    while (table[place] != kNone && position[table[place]] != position[v]) {
      place = (place + 1) & (table.size() - 1);
    }
    if (table[place] == kNone) {
      table[place] = v;
      welded.id.push_back(welded.count++);
    } else {
      welded.id.push_back(welded.id[table[place]]);
    }
  }
  return welded;
}

}  // namespace rebounce

#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "runtime/demo/shading/display_surface.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A piece of an emitting surface, with uniform luminance.
struct EmitterPiece {
  std::array<glm::vec3, 3> corner;
  glm::vec3 centroid{0, 0, 0};
  glm::vec3 normal{0, 0, 0};     ///< unit, on the side that emits
  glm::vec3 luminance{0, 0, 0};  ///< cd/m²
  float area = 0;                ///< m²
};

/// A piece, and the number of pieces that it represents.
struct ChosenPiece {
  const EmitterPiece* piece = nullptr;
  float weight = 1;
};

/// All emitting surface, divided into pieces of about equal power.
class Emitters {
 public:
  /// Divides into about `piece_count` pieces; more if more triangles emit.
  Emitters(const TransferData& data, const DisplaySurface& surface, int piece_count);

  /// The number of draws for a complete picture of the emitters: all pieces, or a sample of
  /// `piece_count` if there are many more.
  std::uint32_t draw_count() const { return draw_count_; }

  /// Draw `index` < draw_count(). `shift` in [0, 1) selects the sampled pieces.
  ChosenPiece draw(std::uint32_t index, float shift) const;

 private:
  void add_pieces(const DisplaySurface& surface, std::uint32_t triangle, int level);
  void find_shares();

  std::vector<EmitterPiece> pieces_;
  std::vector<double> power_end_;  // running sum of the pieces' fractions of the power, last = 1
  std::uint32_t draw_count_ = 0;
};

}  // namespace rebounce

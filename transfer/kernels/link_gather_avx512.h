#pragma once

// Gathering along links with AVX-512 F, BW and VL. The light of a node is one register; each
// quarter is a colour.

#include <immintrin.h>

#include "transfer/kernels/link_gather.h"
#include "transfer/kernels/link_kernels.h"

namespace rebounce {
namespace {

// Quarters of a register.
constexpr __mmask16 kFirst = 0x000F, kOthers = 0xFFF0;

LinkLight gather_avx512(const LinksOfNode& links, const NodeLights<ColorLanes>& light) {
  // For each lane, the index of the gradient component that multiplies it; a link has six.
  const __m512i from_lanes = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2);
  const __m512i to_lanes = _mm512_setr_epi32(0, 0, 0, 0, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5);
  __m512 along = _mm512_setzero_ps(), across = _mm512_setzero_ps();
  const IncomingLink* const link = links.affine;
  for (std::size_t l = 0; l < links.affine_count; ++l) {
    // Both gradients and the two halves of `from`, which no lane uses.
    const __m128i bits = _mm_loadu_si128(reinterpret_cast<const __m128i*>(link + l));
    const __m512 gradient = _mm512_castps256_ps512(
        _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_cvtepu16_epi32(bits), 16)));
    const auto* from = reinterpret_cast<const float*>(light.node(link[l].from));
    const __m512 factor = _mm512_mask_broadcastss_ps(_mm512_permutexvar_ps(from_lanes, gradient),
                                                     kFirst, _mm_load_ss(&link[l].exchange_area));
    along = _mm512_fmadd_ps(factor, _mm512_loadu_ps(from), along);
    across = _mm512_fmadd_ps(_mm512_maskz_permutexvar_ps(kOthers, to_lanes, gradient),
                             _mm512_broadcast_f32x4(_mm_loadu_ps(from)), across);
  }
  LaneSum<ColorLanes> plain_sum;
  add_plain_links(links, light, plain_sum);
  ColorLanes plain;
  plain_sum.store(plain);
  const __m128 affine =
      _mm_add_ps(_mm_add_ps(_mm512_castps512_ps128(along), _mm512_extractf32x4_ps(along, 1)),
                 _mm_add_ps(_mm512_extractf32x4_ps(along, 2), _mm512_extractf32x4_ps(along, 3)));
  const __m128 mean = _mm_add_ps(_mm_loadu_ps(plain.data()), affine);
  LinkLight sum;
  _mm512_storeu_ps(&sum, _mm512_insertf32x4(across, mean, 0));
  return sum;
}

}  // namespace
}  // namespace rebounce

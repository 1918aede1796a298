#pragma once

// Gathering along links with AVX2 and FMA. The light of a node is two registers; each half is a
// colour.

#include <immintrin.h>

#include "transfer/kernels/link_gather.h"
#include "transfer/kernels/link_kernels.h"

namespace rebounce {
namespace {

LinkLight gather_avx2(const LinksOfNode& links, const NodeLights<ColorLanes>& light) {
  // For each lane, the index of the gradient component that multiplies it; a link has six.
  const __m256i from_x = _mm256_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0);
  const __m256i from_yz = _mm256_setr_epi32(1, 1, 1, 1, 2, 2, 2, 2);
  const __m256i to_x = _mm256_setr_epi32(0, 0, 0, 0, 3, 3, 3, 3);
  const __m256i to_yz = _mm256_setr_epi32(4, 4, 4, 4, 5, 5, 5, 5);
  constexpr int kFirst = 0x0F;
  __m256 along[2] = {_mm256_setzero_ps(), _mm256_setzero_ps()};
  __m256 across[2] = {_mm256_setzero_ps(), _mm256_setzero_ps()};
  const IncomingLink* const link = links.affine;
  for (std::size_t l = 0; l < links.affine_count; ++l) {
    // Both gradients and the two halves of `from`, which no lane uses.
    const __m128i bits = _mm_loadu_si128(reinterpret_cast<const __m128i*>(link + l));
    const __m256 gradient = _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_cvtepu16_epi32(bits), 16));
    const auto* from = reinterpret_cast<const float*>(light.node(link[l].from));
    const __m256 mean = _mm256_broadcast_ps(reinterpret_cast<const __m128*>(from));
    const __m256 factor = _mm256_blend_ps(_mm256_permutevar8x32_ps(gradient, from_x),
                                          _mm256_broadcast_ss(&link[l].exchange_area), kFirst);
    along[0] = _mm256_fmadd_ps(factor, _mm256_loadu_ps(from), along[0]);
    along[1] = _mm256_fmadd_ps(_mm256_permutevar8x32_ps(gradient, from_yz),
                               _mm256_loadu_ps(from + 8), along[1]);
    const __m256 to =
        _mm256_blend_ps(_mm256_permutevar8x32_ps(gradient, to_x), _mm256_setzero_ps(), kFirst);
    across[0] = _mm256_fmadd_ps(to, mean, across[0]);
    across[1] = _mm256_fmadd_ps(_mm256_permutevar8x32_ps(gradient, to_yz), mean, across[1]);
  }
  const __m256 both = _mm256_add_ps(along[0], along[1]);
  LaneSum<ColorLanes> plain_sum;
  add_plain_links(links, light, plain_sum);
  ColorLanes plain;
  plain_sum.store(plain);
  const __m128 affine = _mm_add_ps(_mm256_castps256_ps128(both), _mm256_extractf128_ps(both, 1));
  const __m128 mean = _mm_add_ps(_mm_loadu_ps(plain.data()), affine);
  LinkLight sum;
  auto* out = reinterpret_cast<float*>(&sum);
  _mm256_storeu_ps(out, _mm256_insertf128_ps(across[0], mean, 0));
  _mm256_storeu_ps(out + 8, across[1]);
  return sum;
}

}  // namespace
}  // namespace rebounce

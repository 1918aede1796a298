#include "precompute/exchange/links/hemisphere_counts.h"

#include <algorithm>
#include <utility>

#include "precompute/base/parallel_progress.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

constexpr std::uint32_t kBits = 7, kMore = 1U << kBits;

void append(std::uint32_t number, std::vector<std::uint8_t>& bytes) {
  for (; number >= kMore; number >>= kBits) {
    bytes.push_back(static_cast<std::uint8_t>(number | kMore));
  }
  bytes.push_back(static_cast<std::uint8_t>(number));
}

std::uint32_t take(const std::uint8_t*& byte) {
  std::uint32_t number = 0, shift = 0;
  for (; *byte >= kMore; ++byte, shift += kBits) number |= (*byte - kMore) << shift;
  return number | static_cast<std::uint32_t>(*byte++) << shift;
}

}  // namespace

HemisphereCounts::Packed HemisphereCounts::pack(std::span<const MetPatch> met) {
  Packed packed;
  std::uint32_t before = 0;
  for (const MetPatch& m : met) {
    append(m.patch - before, packed);
    append(m.count, packed);
    before = m.patch;
  }
  packed.shrink_to_fit();
  return packed;
}

void HemisphereCounts::unpack(const Packed& packed, std::vector<MetPatch>& met) {
  std::uint32_t patch = 0;
  for (const std::uint8_t *byte = packed.data(), *end = byte + packed.size(); byte != end;) {
    patch += take(byte);
    const std::uint32_t count = take(byte);
    met.push_back({patch, count});
  }
}

HemisphereCounts::HemisphereCounts(const PatchModel& model, const RayTracer& tracer, int ray_count,
                                   std::uint64_t seed)
    : model_(model),
      tracer_(tracer),
      first_rays_(ray_count),
      seed_(seed),
      triangles_(model.mesh.triangle_patch, model.patches.size()),
      first_(model.patches.size()),
      further_(model.patches.size()),
      escape_(model.patches.size()),
      rays_(model.patches.size(), 0.0) {}

void HemisphereCounts::trace(const Progress& progress) {
  rays_.assign(rays_.size(), first_rays_);
  trace(rays_, seed_, progress,
        [&](std::uint32_t i, Escape&& escape, std::span<const MetPatch> met) {
          escape_[i] = std::move(escape);
          first_[i] = pack(met);
        });
  share(Ranks(), escape_);
}

bool HemisphereCounts::trace_further(std::span<const double> more, const Progress& progress) {
  std::vector<double> count(more.begin(), more.end());
  for (std::size_t i = 0; i < count.size(); ++i) {
    if (first_rays_ + count[i] <= rays_[i]) count[i] = 0;
    if (count[i] > 0) rays_[i] = first_rays_ + count[i];
  }
  if (std::ranges::all_of(count, [](double c) { return c == 0; })) return false;
  trace(count, mix_bits(seed_), progress,
        [&](std::uint32_t i, const Escape&, std::span<const MetPatch> met) {
          further_[i] = pack(met);
        });
  return true;
}

std::uint64_t HemisphereCounts::held_bytes() const {
  std::uint64_t bytes = 0;
  for (const Packed& met : first_) bytes += met.capacity();
  for (const Packed& met : further_) bytes += met.capacity();
  return bytes;
}

/// Traces `count` [n] rays of each patch. `keep`(i, escape, met) is called where there are any,
/// from several threads.
template <typename Keep>
void HemisphereCounts::trace(std::span<const double> count, std::uint64_t seed,
                             const Progress& progress, const Keep& keep) {
  const std::size_t n = count.size();
  const Ranks ranks;
  ParallelProgress loop(progress, n);
  struct Scratch {
    EscapeScratch escape;
    MetPatchCounter counter;
  };
  parallel_loop(
      n, 16, [] { return Scratch(); },
      [&](std::uint32_t i, Scratch& scratch) {
        if (loop.stopped() || count[i] == 0 || !ranks.makes(i)) return;
        Escape escape = measure_escape(model_.mesh, model_.shown_patch, triangles_[i], i, tracer_,
                                       static_cast<int>(count[i]), seed, scratch.escape);
        keep(i, std::move(escape), scratch.counter.count(n, scratch.escape.met));
        loop.advance();
      });
  loop.finish();
  for (const double c : count) traced_ += static_cast<std::uint64_t>(c);
}

}  // namespace rebounce

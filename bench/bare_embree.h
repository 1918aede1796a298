#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "bench/stage_rays.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// How rays are handed to Embree.
enum class TraceMode : std::uint8_t {
  kCoherentStream,    ///< rtcOccluded1M and rtcIntersect1M, flagged as coherent
  kIncoherentStream,  ///< the same, not flagged
  kSingle,            ///< rtcOccluded1 and rtcIntersect1
};
inline constexpr std::array kTraceModes = {TraceMode::kCoherentStream, TraceMode::kIncoherentStream,
                                           TraceMode::kSingle};

const char* name(TraceMode mode);

/// The ceiling for the form-factor phase: Embree on rays that lie ready, with nothing around it but
/// a loop over the streams on all threads. Its scene has the flags of RayTracer's.
class BareEmbree {
 public:
  /// Takes the first surface_count triangles of `mesh` and a copy of `rays`. Throws Error if Embree
  /// refuses.
  BareEmbree(const DisplayMesh& mesh, const StageRays& rays);
  ~BareEmbree();

  /// Makes all rays untraced again.
  void reset();

  void trace_shadow(TraceMode mode);
  void trace_escape(TraceMode mode);

  /// Shadow rays that met something since the last reset.
  std::uint64_t hidden_count() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rebounce::bench

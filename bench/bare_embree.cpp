// With runtime/ray_tracer.cpp, the only file that knows Embree.

#include "bench/bare_embree.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <bit>

#include "transfer/base/error.h"

namespace rebounce::bench {
namespace {

RTCRayHit without_hit(const Ray& ray) {
  RTCRayHit result{};
  result.ray = std::bit_cast<RTCRay>(ray);
  result.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  result.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return result;
}

RTCIntersectContext context_for(TraceMode mode) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = mode == TraceMode::kCoherentStream ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                     : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

RTCGeometry make_geometry(RTCDevice device, const DisplayMesh& mesh) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Float3), mesh.position.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          sizeof(Uint3), mesh.surface_count());
  if (vertices == nullptr || indices == nullptr) throw Error("Embree is out of memory");
  std::ranges::copy(mesh.position, static_cast<Float3*>(vertices));
  std::copy_n(mesh.triangle.begin(), mesh.surface_count(), static_cast<Uint3*>(indices));
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
  rtcSetGeometryMask(geometry, 0xFFFFFFFFU);
  rtcCommitGeometry(geometry);
  return geometry;
}

}  // namespace

const char* name(TraceMode mode) {
  switch (mode) {
    case TraceMode::kCoherentStream:
      return "coherent streams";
    case TraceMode::kIncoherentStream:
      return "incoherent streams";
    case TraceMode::kSingle:
      break;
  }
  return "single rays";
}

struct BareEmbree::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const StageRays& untraced;
  std::vector<std::vector<Ray>> shadow;
  std::vector<std::vector<RTCRayHit>> escape;

  explicit Impl(const StageRays& rays) : untraced(rays) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

BareEmbree::BareEmbree(const DisplayMesh& mesh, const StageRays& rays)
    : impl_(std::make_unique<Impl>(rays)) {
  impl_->device = rtcNewDevice("threads=1");
  if (impl_->device == nullptr) throw Error("Embree does not start; check its installation");
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
  const RTCGeometry geometry = make_geometry(impl_->device, mesh);
  rtcAttachGeometry(impl_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(impl_->scene);
  if (rtcGetDeviceError(impl_->device) != RTC_ERROR_NONE) throw Error("Embree refuses the scene");
  reset();
}

BareEmbree::~BareEmbree() = default;

void BareEmbree::reset() {
  impl_->shadow = impl_->untraced.shadow;
  impl_->escape.resize(impl_->untraced.escape.size());
  for (std::size_t s = 0; s < impl_->escape.size(); ++s) {
    impl_->escape[s].resize(impl_->untraced.escape[s].size());
    std::ranges::transform(impl_->untraced.escape[s], impl_->escape[s].begin(), without_hit);
  }
}

void BareEmbree::trace_shadow(TraceMode mode) {
#pragma omp parallel for schedule(dynamic, 4)
  for (std::vector<Ray>& stream : impl_->shadow) {
    RTCIntersectContext context = context_for(mode);
    auto* rays = reinterpret_cast<RTCRay*>(stream.data());
    if (mode == TraceMode::kSingle) {
      for (std::size_t k = 0; k < stream.size(); ++k)
        rtcOccluded1(impl_->scene, &context, &rays[k]);
    } else {
      rtcOccluded1M(impl_->scene, &context, rays, static_cast<unsigned>(stream.size()),
                    sizeof(RTCRay));
    }
  }
}

void BareEmbree::trace_escape(TraceMode mode) {
#pragma omp parallel for schedule(dynamic, 4)
  for (std::vector<RTCRayHit>& stream : impl_->escape) {
    RTCIntersectContext context = context_for(mode);
    if (mode == TraceMode::kSingle) {
      for (RTCRayHit& ray : stream) rtcIntersect1(impl_->scene, &context, &ray);
    } else {
      rtcIntersect1M(impl_->scene, &context, stream.data(), static_cast<unsigned>(stream.size()),
                     sizeof(RTCRayHit));
    }
  }
}

std::uint64_t BareEmbree::hidden_count() const {
  std::uint64_t count = 0;
  for (const std::vector<Ray>& stream : impl_->shadow) {
    count += static_cast<std::uint64_t>(std::ranges::count_if(stream, is_occluded));
  }
  return count;
}

}  // namespace rebounce::bench

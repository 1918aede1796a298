// The only file of the libraries that knows Embree.

#include "rebounce/runtime/ray_tracer.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <string>

#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

static_assert(sizeof(Ray) == sizeof(RTCRay) && alignof(Ray) == alignof(RTCRay));
static_assert(offsetof(Ray, origin) == offsetof(RTCRay, org_x));
static_assert(offsetof(Ray, t_near) == offsetof(RTCRay, tnear));
static_assert(offsetof(Ray, direction) == offsetof(RTCRay, dir_x));
static_assert(offsetof(Ray, time) == offsetof(RTCRay, time));
static_assert(offsetof(Ray, t_far) == offsetof(RTCRay, tfar));
static_assert(offsetof(Ray, mask) == offsetof(RTCRay, mask));
static_assert(offsetof(Ray, id) == offsetof(RTCRay, id));
static_assert(offsetof(Ray, flags) == offsetof(RTCRay, flags));
static_assert(RTC_INVALID_GEOMETRY_ID == kNone);

constexpr std::size_t kBatch = 64;  // rays copied to the stack at a time by intersect()

// One builder thread: the tree, and with it which of two coincident triangles wins, is the same on
// every machine, and no threads are left behind.
constexpr const char* kDeviceConfig = "threads=1";

void throw_if_failed(RTCDevice device, const char* step) {
  const RTCError code = rtcGetDeviceError(device);
  if (code == RTC_ERROR_NONE) return;
  const bool memory = code == RTC_ERROR_OUT_OF_MEMORY;
  throw Error("ray tracer: " + std::string(step) + " failed, " +
              (memory
                   ? "out of memory; use a smaller scene or a larger machine"
                   : "Embree error " + std::to_string(code) + "; check the Embree installation"));
}

void attach_triangles(RTCDevice device, RTCScene scene, std::span<const Float3> position,
                      std::span<const Uint3> triangle) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<Float3*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Float3), position.size()));
  auto* indices = static_cast<Uint3*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Uint3), triangle.size()));
  if (vertices != nullptr && indices != nullptr) {
    std::copy(position.begin(), position.end(), vertices);
    std::copy(triangle.begin(), triangle.end(), indices);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcSetGeometryMask(geometry, 0xFFFFFFFFU);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  throw_if_failed(device, "copying the triangles");
}

RTCIntersectContext context_with(RTCIntersectContextFlags flags) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  return context;
}

Hit to_hit(const RTCRayHit& traced) {
  if (traced.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const float facing = traced.hit.Ng_x * traced.ray.dir_x + traced.hit.Ng_y * traced.ray.dir_y +
                       traced.hit.Ng_z * traced.ray.dir_z;
  return {.t = traced.ray.tfar,
          .triangle = traced.hit.primID,
          .u = traced.hit.u,
          .v = traced.hit.v,
          .front = facing < 0};
}

}  // namespace

struct RayTracer::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  float offset_distance = 0;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

RayTracer::RayTracer(std::span<const Float3> position, std::span<const Uint3> triangle)
    : impl_(std::make_unique<Impl>()) {
  impl_->device = rtcNewDevice(kDeviceConfig);
  if (impl_->device == nullptr) throw_if_failed(nullptr, "starting Embree");
  impl_->scene = rtcNewScene(impl_->device);
  throw_if_failed(impl_->device, "making a scene");
  // The filter is for intersect_all.
  rtcSetSceneFlags(
      impl_->scene,
      static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
  if (!triangle.empty()) attach_triangles(impl_->device, impl_->scene, position, triangle);
  rtcCommitScene(impl_->scene);
  float largest = 0;
  for (const Float3& p : position) {
    for (const float x : p) largest = std::max(largest, std::abs(x));
  }
  impl_->offset_distance = largest * 0x1p-18F;
  throw_if_failed(impl_->device, "building the acceleration structure");
}

RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::occluded(std::span<Ray> rays) const {
  if (rays.empty()) return;
  RTCIntersectContext context = context_with(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  rtcOccluded1M(impl_->scene, &context, reinterpret_cast<RTCRay*>(rays.data()),
                static_cast<unsigned>(rays.size()), sizeof(Ray));
}

void RayTracer::intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
  assert(rays.size() == hits.size());
  // Nearest hits are asked for over whole hemispheres: such rays soon part.
  RTCIntersectContext context = context_with(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  std::array<RTCRayHit, kBatch> batch;
  for (std::size_t begin = 0; begin < rays.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, rays.size() - begin);
    for (std::size_t k = 0; k < count; ++k) {
      batch[k].ray = std::bit_cast<RTCRay>(rays[begin + k]);
      batch[k].hit.geomID = RTC_INVALID_GEOMETRY_ID;
      batch[k].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect1M(impl_->scene, &context, batch.data(), static_cast<unsigned>(count),
                   sizeof(RTCRayHit));
    for (std::size_t k = 0; k < count; ++k) hits[begin + k] = to_hit(batch[k]);
  }
}

void RayTracer::intersect_all(const Ray& ray, std::vector<Hit>& hits) const {
  // The filter keeps each hit and lets the ray go on.
  struct CollectingContext {
    RTCIntersectContext context;
    std::vector<Hit>* hits;
  } collecting{context_with(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT), &hits};
  collecting.context.filter = [](const RTCFilterFunctionNArguments* arguments) {
    auto* const context = reinterpret_cast<CollectingContext*>(arguments->context);
    for (unsigned k = 0; k < arguments->N; ++k) {
      if (arguments->valid[k] == 0) continue;
      RTCRayHit traced;
      traced.ray = rtcGetRayFromRayN(arguments->ray, arguments->N, k);
      traced.hit = rtcGetHitFromHitN(arguments->hit, arguments->N, k);
      context->hits->push_back(to_hit(traced));
      arguments->valid[k] = 0;
    }
  };
  RTCRayHit traced;
  traced.ray = std::bit_cast<RTCRay>(ray);
  traced.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  traced.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &collecting.context, &traced);
}

Float3 RayTracer::offset_point(const Float3& point, const Float3& geometric_normal) const {
  Float3 moved;
  for (int axis = 0; axis < 3; ++axis) {
    moved[axis] = point[axis] + impl_->offset_distance * geometric_normal[axis];
  }
  return moved;
}

float RayTracer::offset_distance() const {
  return impl_->offset_distance;
}

}  // namespace rebounce

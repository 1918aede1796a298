// The only file of the libraries that uses Embree.

#include "runtime/rays/ray_tracer.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <new>
#include <string>

#include "rebounce/error.h"
#include "runtime/rays/opacity_passage.h"
#include "transfer/data/opacity_maps.h"

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

constexpr std::size_t kBatch = 64;  // rays that intersect() copies to the stack at a time

void throw_if_failed(RTCDevice device, const char* step) {
  const RTCError code = rtcGetDeviceError(device);
  if (code == RTC_ERROR_NONE) return;
  if (code == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw Error("ray tracer: " + std::string(step) + " failed, Embree error " + std::to_string(code) +
              "; check the Embree installation");
}

// Builds the tree on one thread: then it is the same on every machine, and so is the choice between
// coincident triangles. An arena of its own does that; Embree's option `threads` limits TBB in the
// whole process for as long as a device lives.
void build_on_this_thread(RTCScene scene) {
  tbb::task_arena arena(1);
  arena.execute([scene] { rtcCommitScene(scene); });
}

// The triangles of one Embree geometry.
struct TriangleGroup {
  std::vector<std::uint32_t> index;  // index among all triangles; empty if the same
  OpacityMaps opacity;               // one map per triangle; empty if all are opaque
  std::vector<float> transmitted;    // [triangles] mean fraction of light that passes through

  std::uint32_t index_of(std::uint32_t primitive) const {
    return index.empty() ? primitive : index[primitive];
  }
};

// Groups by Embree's geometry ID. Triangles without a map are in a group that needs no filter.
enum GroupId : std::uint8_t { kSolid, kPorous, kGroupCount };
using TriangleGroups = std::array<TriangleGroup, kGroupCount>;

// What a ray does at triangles of the porous group.
enum class Rule : std::uint8_t { kHoles, kStop, kTriangleMeans, kMicroTriangles };

// What a filter receives from the call that it serves.
struct TraceContext {
  RTCIntersectContext context;
  const TriangleGroups* groups;
  Rule rule;
  float* transmitted = nullptr;      // by ray id; for the last two rules
  std::vector<Hit>* hits = nullptr;  // for intersect_all
};

TraceContext make_context(const TriangleGroups& groups, RTCIntersectContextFlags flags, Rule rule) {
  TraceContext trace{.context = {}, .groups = &groups, .rule = rule};
  rtcInitIntersectContext(&trace.context);
  trace.context.flags = flags;
  return trace;
}

Hit to_hit(const RTCRayHit& traced, const TriangleGroups& groups) {
  if (traced.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const float facing = traced.hit.Ng_x * traced.ray.dir_x + traced.hit.Ng_y * traced.ray.dir_y +
                       traced.hit.Ng_z * traced.ray.dir_z;
  return {.t = traced.ray.tfar,
          .triangle = groups[traced.hit.geomID].index_of(traced.hit.primID),
          .u = traced.hit.u,
          .v = traced.hit.v,
          .front = facing < 0};
}

// True if the ray stops at this hit of the porous group.
bool stops(const RTCRay& ray, const RTCHit& hit, const TraceContext& trace) {
  const TriangleGroup& group = (*trace.groups)[kPorous];
  if (trace.rule == Rule::kStop) return true;
  if (trace.rule == Rule::kTriangleMeans) {
    trace.transmitted[ray.id] *= group.transmitted[hit.primID];
    return false;
  }
  const float part = stopped_part(group.opacity.of_triangle(hit.primID), hit.u, hit.v);
  if (trace.rule == Rule::kMicroTriangles) {
    trace.transmitted[ray.id] *= 1 - part;
    return false;
  }
  return stops_by_chance({ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z},
                         group.index_of(hit.primID), part);
}

// The filter of the porous group: lets rays continue.
void let_pass(const RTCFilterFunctionNArguments* arguments) {
  const auto& trace = *reinterpret_cast<const TraceContext*>(arguments->context);
  for (unsigned k = 0; k < arguments->N; ++k) {
    if (arguments->valid[k] == 0) continue;
    const RTCRay ray = rtcGetRayFromRayN(arguments->ray, arguments->N, k);
    const RTCHit hit = rtcGetHitFromHitN(arguments->hit, arguments->N, k);
    if (!stops(ray, hit, trace)) arguments->valid[k] = 0;
  }
}

// The filter of intersect_all: stores each hit and lets the ray continue.
void collect(const RTCFilterFunctionNArguments* arguments) {
  const auto& trace = *reinterpret_cast<const TraceContext*>(arguments->context);
  for (unsigned k = 0; k < arguments->N; ++k) {
    if (arguments->valid[k] == 0) continue;
    RTCRayHit traced;
    traced.ray = rtcGetRayFromRayN(arguments->ray, arguments->N, k);
    traced.hit = rtcGetHitFromHitN(arguments->hit, arguments->N, k);
    trace.hits->push_back(to_hit(traced, *trace.groups));
    arguments->valid[k] = 0;
  }
}

void attach_triangles(RTCDevice device, RTCScene scene, GroupId id,
                      std::span<const Float3> position, std::span<const Uint3> triangle) {
  if (triangle.empty()) return;
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
    if (id == kPorous) {
      rtcSetGeometryIntersectFilterFunction(geometry, let_pass);
      rtcSetGeometryOccludedFilterFunction(geometry, let_pass);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
  }
  rtcReleaseGeometry(geometry);
  throw_if_failed(device, "copying the triangles");
}

}  // namespace

struct RayTracer::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  TriangleGroups groups;
  float offset_distance = 0;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  bool has_porous() const { return !groups[kPorous].index.empty(); }

  /// Divides the triangles into groups and passes them to Embree.
  void attach_by_group(std::span<const Float3> position, std::span<const Uint3> triangle,
                       const OpacityMaps& opacity) {
    std::array<std::vector<Uint3>, kGroupCount> grouped;
    for (std::uint32_t t = 0; t < triangle.size(); ++t) {
      const bool porous = !opacity.of_triangle(t).empty();
      TriangleGroup& group = groups[porous ? kPorous : kSolid];
      grouped[porous ? kPorous : kSolid].push_back(triangle[t]);
      group.index.push_back(t);
      if (!porous) continue;
      group.opacity.triangle_map.push_back(opacity.triangle_map[t]);
      group.transmitted.push_back(static_cast<float>(1 - opacity.stopping_part(t)));
    }
    groups[kPorous].opacity.begin = opacity.begin;
    groups[kPorous].opacity.opacity = opacity.opacity;
    for (const GroupId id : {kSolid, kPorous}) {
      attach_triangles(device, scene, id, position, grouped[id]);
    }
  }
};

RayTracer::RayTracer(std::span<const Float3> position, std::span<const Uint3> triangle,
                     const OpacityMaps& opacity)
    : impl_(std::make_unique<Impl>()) {
  impl_->device = rtcNewDevice(nullptr);
  if (impl_->device == nullptr) throw_if_failed(nullptr, "starting Embree");
  impl_->scene = rtcNewScene(impl_->device);
  throw_if_failed(impl_->device, "making a scene");
  // intersect_all needs the filter.
  rtcSetSceneFlags(
      impl_->scene,
      static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  if (opacity.empty()) {
    attach_triangles(impl_->device, impl_->scene, kSolid, position, triangle);
  } else {
    impl_->attach_by_group(position, triangle, opacity);
  }
  // High quality may put a triangle into several leaves. Filters would then be called more than
  // once for one hit, but transmittance() needs each hit exactly once.
  rtcSetSceneBuildQuality(impl_->scene,
                          impl_->has_porous() ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH);
  build_on_this_thread(impl_->scene);
  impl_->offset_distance = ray_offset_distance(position);
  throw_if_failed(impl_->device, "building the acceleration structure");
}

RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::occluded(std::span<Ray> rays) const {
  if (rays.empty()) return;
  TraceContext trace =
      make_context(impl_->groups, RTC_INTERSECT_CONTEXT_FLAG_COHERENT, Rule::kHoles);
  rtcOccluded1M(impl_->scene, &trace.context, reinterpret_cast<RTCRay*>(rays.data()),
                static_cast<unsigned>(rays.size()), sizeof(Ray));
}

void RayTracer::transmittance(std::span<Ray> rays, PassageDetail detail,
                              std::span<float> part) const {
  assert(rays.size() == part.size());
  if (!impl_->has_porous()) {
    occluded(rays);
    std::ranges::transform(rays, part.begin(),
                           [](const Ray& ray) { return is_occluded(ray) ? 0.0F : 1.0F; });
    return;
  }
  // Coherent traversal calls filters more than once for one hit (Embree 3.13).
  TraceContext trace = make_context(
      impl_->groups, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT,
      detail == PassageDetail::kTriangle ? Rule::kTriangleMeans : Rule::kMicroTriangles);
  trace.transmitted = part.data();
  // The filter identifies rays by number; their own ids are kept in an unused field meanwhile.
  for (std::size_t k = 0; k < rays.size(); ++k) {
    rays[k].time = std::bit_cast<float>(rays[k].id);
    rays[k].id = static_cast<std::uint32_t>(k);
    part[k] = 1;
  }
  rtcOccluded1M(impl_->scene, &trace.context, reinterpret_cast<RTCRay*>(rays.data()),
                static_cast<unsigned>(rays.size()), sizeof(Ray));
  for (std::size_t k = 0; k < rays.size(); ++k) {
    rays[k].id = std::bit_cast<std::uint32_t>(rays[k].time);
    rays[k].time = 0;
    if (is_occluded(rays[k])) part[k] = 0;
  }
}

void RayTracer::intersect(std::span<const Ray> rays, std::span<Hit> hits, Passage passage) const {
  assert(rays.size() == hits.size());
  // Callers ask for nearest hits over whole hemispheres, where rays diverge early.
  TraceContext trace = make_context(impl_->groups, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT,
                                    passage == Passage::kHoles ? Rule::kHoles : Rule::kStop);
  std::array<RTCRayHit, kBatch> batch;
  for (std::size_t begin = 0; begin < rays.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, rays.size() - begin);
    for (std::size_t k = 0; k < count; ++k) {
      batch[k].ray = std::bit_cast<RTCRay>(rays[begin + k]);
      batch[k].hit.geomID = RTC_INVALID_GEOMETRY_ID;
      batch[k].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect1M(impl_->scene, &trace.context, batch.data(), static_cast<unsigned>(count),
                   sizeof(RTCRayHit));
    for (std::size_t k = 0; k < count; ++k) hits[begin + k] = to_hit(batch[k], impl_->groups);
  }
}

void RayTracer::intersect_all(const Ray& ray, std::vector<Hit>& hits) const {
  TraceContext trace =
      make_context(impl_->groups, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT, Rule::kHoles);
  trace.context.filter = collect;
  trace.hits = &hits;
  RTCRayHit traced;
  traced.ray = std::bit_cast<RTCRay>(ray);
  traced.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  traced.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &trace.context, &traced);
}

float RayTracer::offset_distance() const {
  return impl_->offset_distance;
}

}  // namespace rebounce

// Path tracing after J. Kajiya, "The rendering equation", 1986, with emitters looked for in two
// ways that are joined by the balance heuristic of E. Veach and L. Guibas, "Optimally combining
// sampling techniques for Monte Carlo rendering", 1995. Paths advance together, a batch at a time,
// so that rays are traced in streams.

#include "bench/reference/path_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "bench/reference/emitter_sampler.h"
#include "bench/reference/path_sampling.h"
#include "bench/reference/scene_surface.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/patches/opacity_sampling.h"
#include "rebounce/error.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/lights/sky_light.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::reference {
namespace {

constexpr std::size_t kBatchPaths = 4096;  // that advance together on one thread

// Surfaces that every path visits before it may be ended by chance.
constexpr int kSureVertices = 4;

// Below this throughput, chance decides: those that survive have it again.
constexpr double kRouletteThroughput = 0.25;

struct Path {
  std::uint64_t random;      // state of its random numbers
  VertexNumbers numbers;     // of the vertex where it is
  Float3 origin;             // that vertex, moved off its surface
  glm::dvec3 normal;         // unit, there
  glm::dvec3 throughput{1};  // what part of light found from here on counts
  glm::dvec3 gathered{0};    // lx
  double cosine = 0;         // of the ray onwards
  bool absorbed = false;     // the first ray met a back face
};

struct ShadowQuery {
  std::uint32_t path;
  glm::dvec3 contribution;  // lx, if nothing is in the way
};

struct Scratch {
  std::vector<Path> paths;
  std::vector<std::uint32_t> active;  // paths that go on
  std::vector<Ray> rays, shadow_rays;
  std::vector<Hit> hits;
  std::vector<ShadowQuery> shadow_queries;  // beside shadow_rays
};

class PathTracer {
 public:
  explicit PathTracer(const LitScene& lit_scene)
      : tracer_(lit_scene.tracer),
        lights_(lit_scene.lights),
        sky_(lit_scene.sky),
        surface_(lit_scene.scene),
        emitters_(surface_) {}
  PathTracer(const PathTracer&) = delete;  // emitters_ refers to surface_
  PathTracer& operator=(const PathTracer&) = delete;

  /// A path that begins at `point` with `numbers` for its first vertex.
  Path begin(const SurfacePoint& point, const VertexNumbers& numbers, std::uint64_t random) const {
    return {.random = random,
            .numbers = numbers,
            .origin = tracer_.offset_point(point.position, point.normal),
            .normal = to_dvec3(point.normal)};
  }

  /// Follows scratch.paths to their ends; what they gather stays in them.
  void follow(Scratch& scratch) const {
    scratch.active.resize(scratch.paths.size());
    for (std::uint32_t k = 0; k < scratch.active.size(); ++k) scratch.active[k] = k;
    for (int vertex = 0; !scratch.active.empty(); ++vertex) {
      gather_directly(vertex, scratch);
      advance(vertex, scratch);
    }
  }

 private:
  /// Adds what emitters, and beyond the first vertex lamps, send straight to the active paths.
  void gather_directly(int vertex, Scratch& scratch) const {
    scratch.shadow_rays.clear();
    scratch.shadow_queries.clear();
    for (const std::uint32_t k : scratch.active) {
      if (vertex > 0) look_at_a_lamp(k, scratch);
      if (!emitters_.empty()) look_at_an_emitter(k, scratch);
    }
    tracer_.occluded(scratch.shadow_rays);
    for (std::size_t s = 0; s < scratch.shadow_rays.size(); ++s) {
      if (is_occluded(scratch.shadow_rays[s])) continue;
      const ShadowQuery& query = scratch.shadow_queries[s];
      scratch.paths[query.path].gathered += query.contribution;
    }
  }

  /// One lamp, chosen in proportion to its unshadowed light: exact if there is but one.
  void look_at_a_lamp(std::uint32_t k, Scratch& scratch) const {
    const Path& path = scratch.paths[k];
    double total = 0, chosen_weight = 0, number = path.numbers.lamp;
    glm::dvec3 irradiance(0);
    IncidentLight chosen;
    // Where on a lamp with a surface; emitters of the scene are another integral.
    const Float2 place = {static_cast<float>(path.numbers.emitter_point.x),
                          static_cast<float>(path.numbers.emitter_point.y)};
    for (const Light& light : lights_) {
      const IncidentLight incident = evaluate_light(light, path.origin, place);
      const double cosine = glm::dot(to_dvec3(incident.direction), path.normal);
      const glm::dvec3 e = std::max(cosine, 0.0) * to_dvec3(incident.illuminance);
      const double weight = e.x + e.y + e.z;
      if (!(weight > 0)) continue;
      total += weight;
      // Reservoir sampling; the number is stretched to be used again.
      const double part = weight / total;
      if (number < part) {
        number /= part;
        chosen = incident;
        chosen_weight = weight;
        irradiance = e;
      } else {
        number = (number - part) / (1 - part);
      }
    }
    if (!(total > 0)) return;
    Ray ray{};
    ray.origin = path.origin;
    ray.direction = chosen.direction;
    ray.t_near = 0;
    ray.t_far = shadow_ray_length(chosen.distance);
    scratch.shadow_rays.push_back(ray);
    scratch.shadow_queries.push_back({k, path.throughput * irradiance * (total / chosen_weight)});
  }

  void look_at_an_emitter(std::uint32_t k, Scratch& scratch) const {
    const Path& path = scratch.paths[k];
    const EmitterPoint emitter = emitters_.sample(path.numbers.emitter, path.numbers.emitter_point);
    const glm::dvec3 origin = to_dvec3(path.origin);
    const glm::dvec3 way = emitter.position - origin;
    const double distance = glm::length(way);
    if (!(distance > 0)) return;
    const double cosine = glm::dot(path.normal, way) / distance;
    const double front_cosine = -glm::dot(emitter.front_normal, way) / distance;
    const bool is_seen = front_cosine > 0 || surface_.material(emitter.triangle).double_sided;
    if (!(cosine > 0) || front_cosine == 0 || !is_seen) return;

    const double emitter_density =
        emitters_.area_density(emitter.triangle) * distance * distance / std::abs(front_cosine);
    // M cos / (pi emitter_density), weighted by emitter_density / (emitter_density +
    // cosine_density).
    const double cosine_density = cosine / std::numbers::pi;
    const double weight = cosine_density / (emitter_density + cosine_density);
    const Float3 end =
        tracer_.offset_point(to_float3(emitter.position),
                             to_float3(emitter.front_normal * (front_cosine > 0 ? 1.0 : -1.0)));
    Ray ray{};
    ray.origin = path.origin;
    ray.direction = to_float3(to_dvec3(end) - origin);
    ray.t_near = 0;
    ray.t_far = 1;
    scratch.shadow_rays.push_back(ray);
    scratch.shadow_queries.push_back(
        {k, weight * path.throughput *
                surface_.emitted_exitance(emitter.triangle, emitter.barycentric)});
  }

  /// Sends the active paths onwards by one cosine-distributed ray; those that end leave the list.
  void advance(int vertex, Scratch& scratch) const {
    scratch.rays.clear();
    for (const std::uint32_t k : scratch.active) {
      Path& path = scratch.paths[k];
      const glm::dvec3 local = square_to_cosine_hemisphere(path.numbers.direction);
      path.cosine = local.z;
      Ray ray{};
      ray.origin = path.origin;
      ray.direction = to_float3(frame_around(path.normal) * local);
      ray.t_near = 0;
      ray.t_far = std::numeric_limits<float>::infinity();
      scratch.rays.push_back(ray);
    }
    scratch.hits.resize(scratch.rays.size());
    tracer_.intersect(scratch.rays, scratch.hits);
    std::size_t left = 0;
    for (std::size_t a = 0; a < scratch.active.size(); ++a) {
      const std::uint32_t k = scratch.active[a];
      const bool goes_on = arrive(vertex, scratch.rays[a], scratch.hits[a], scratch.paths[k]);
      if (goes_on) scratch.active[left++] = k;
    }
    scratch.active.resize(left);
  }

  /// What a surface receives that sees nothing but sky of the luminance in this direction, lx.
  glm::dvec3 sky_exitance(const Float3& direction) const {
    return std::numbers::pi * to_dvec3(sky_luminance(sky_, direction));
  }

  /// Takes up what the ray met after vertex number `vertex`; false if the path ends there.
  bool arrive(int vertex, const Ray& ray, const Hit& hit, Path& path) const {
    if (hit.triangle == kNone) {
      // The sky that the first vertex sees is its direct light.
      if (vertex > 0) path.gathered += path.throughput * sky_exitance(ray.direction);
      return false;
    }
    if (!hit.front && !surface_.material(hit.triangle).double_sided) {
      path.absorbed = vertex == 0;
      return false;
    }
    const TriangleCorners corners = surface_.corners(hit.triangle);
    const glm::dvec2 barycentric(hit.u, hit.v);
    const glm::dvec3 normal = front_normal(corners) * (hit.front ? 1.0 : -1.0);
    add_emission(ray, hit, normal, path);

    path.throughput *= surface_.reflectance(hit.triangle, barycentric);
    const double largest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
    if (!(largest > 0)) return false;
    path.numbers = random_numbers(path.random);
    const double survival = largest / kRouletteThroughput;
    if (vertex + 1 >= kSureVertices && survival < 1) {
      if (path.numbers.survival >= survival) return false;
      path.throughput /= survival;
    }
    path.origin =
        tracer_.offset_point(to_float3(point_at(corners, barycentric)), to_float3(normal));
    path.normal = normal;
    return true;
  }

  /// Emission that a ray meets by itself, with the weight that look_at_an_emitter leaves it.
  void add_emission(const Ray& ray, const Hit& hit, const glm::dvec3& normal, Path& path) const {
    const glm::dvec3 exitance = surface_.emitted_exitance(hit.triangle, glm::dvec2(hit.u, hit.v));
    if (exitance == glm::dvec3(0)) return;
    const double cosine = std::max(-glm::dot(normal, to_dvec3(ray.direction)), 1e-12);
    const double emitter_density =
        emitters_.area_density(hit.triangle) * static_cast<double>(hit.t) * hit.t / cosine;
    const double cosine_density = path.cosine / std::numbers::pi;
    path.gathered +=
        path.throughput * exitance * (cosine_density / (cosine_density + emitter_density));
  }

  const RayTracer& tracer_;
  std::span<const Light> lights_;
  Sky sky_;
  SceneSurface surface_;
  EmitterSampler emitters_;
};

/// What the paths of one point brought.
struct PointSums {
  std::array<glm::dvec3, kReplicateCount> gathered{};
  std::uint32_t absorbed = 0;
};

/// Shares points out among threads in blocks, and each block's paths in batches.
class Measurement {
 public:
  Measurement(const LitScene& lit_scene, std::span<const SurfacePoint> points,
              std::uint32_t samples_per_point, std::uint64_t seed)
      : path_tracer_(lit_scene),
        points_(points),
        samples_(samples_per_point),
        points_per_block_(std::max<std::size_t>(1, kBatchPaths / samples_per_point)),
        samples_per_batch_(static_cast<std::uint32_t>(kBatchPaths / points_per_block_)),
        seed_(seed) {
    estimate_.mean.resize(points.size());
    estimate_.standard_error.resize(points.size());
    estimate_.absorbed.resize(points.size());
  }

  IrradianceEstimate run(const Progress& progress) {
    const std::size_t blocks = (points_.size() + points_per_block_ - 1) / points_per_block_;
    if (progress && !progress(0)) throw Cancelled();
    ParallelProgress loop(progress, blocks);
#pragma omp parallel
    {
      Scratch scratch;
#pragma omp for schedule(dynamic, 1)
      for (std::size_t b = 0; b < blocks; ++b) {
        if (loop.stopped()) continue;
        measure_block(b * points_per_block_, std::min(points_.size(), (b + 1) * points_per_block_),
                      scratch);
        loop.advance();
      }
    }
    loop.finish();
    return std::move(estimate_);
  }

 private:
  void measure_block(std::size_t begin, std::size_t end, Scratch& scratch) {
    std::vector<PointSums> sums(end - begin);
    for (std::uint32_t first = 0; first < samples_; first += samples_per_batch_) {
      const std::uint32_t last = std::min(samples_, first + samples_per_batch_);
      scratch.paths.clear();
      for (std::size_t p = begin; p < end; ++p) {
        for (std::uint32_t s = first; s < last; ++s) scratch.paths.push_back(make_path(p, s));
      }
      path_tracer_.follow(scratch);
      auto path = scratch.paths.begin();
      for (PointSums& sum : sums) {
        for (std::uint32_t s = first; s < last; ++s, ++path) {
          sum.gathered[s % kReplicateCount] += path->gathered;
          sum.absorbed += path->absorbed ? 1 : 0;
        }
      }
    }
    for (std::size_t p = begin; p < end; ++p) store(p, sums[p - begin]);
  }

  /// Path `sample` of a point: replicates take turns.
  Path make_path(std::size_t point, std::uint32_t sample) const {
    const std::uint64_t key =
        mix_bits(mix_bits(seed_ ^ mix_bits(point)) + sample % kReplicateCount);
    const std::uint32_t k = sample / kReplicateCount;
    return path_tracer_.begin(points_[point], stratified_numbers(k, key),
                              mix_bits(key ^ mix_bits(k)));
  }

  void store(std::size_t point, const PointSums& sums) {
    constexpr double kReplicates = kReplicateCount;
    const double samples_per_replicate = samples_ / kReplicates;
    glm::dvec3 mean(0), spread(0);
    for (const glm::dvec3& g : sums.gathered) mean += g / samples_per_replicate / kReplicates;
    for (const glm::dvec3& g : sums.gathered) {
      const glm::dvec3 difference = g / samples_per_replicate - mean;
      spread += difference * difference;
    }
    estimate_.mean[point] = to_float3(mean);
    estimate_.standard_error[point] =
        to_float3(glm::sqrt(spread / (kReplicates * (kReplicates - 1))));
    estimate_.absorbed[point] = static_cast<float>(sums.absorbed) / static_cast<float>(samples_);
  }

  PathTracer path_tracer_;
  std::span<const SurfacePoint> points_;
  std::uint32_t samples_;
  std::size_t points_per_block_;
  std::uint32_t samples_per_batch_;
  std::uint64_t seed_;
  IrradianceEstimate estimate_;
};

std::uint32_t rounded_up(std::uint32_t samples) {
  return (samples + kReplicateCount - 1) / kReplicateCount * kReplicateCount;
}

}  // namespace

RayTracer make_scene_tracer(const Scene& scene) {
  return {scene.position, scene.triangle, find_opacity_maps(scene)};
}

IrradianceEstimate indirect_irradiance(const LitScene& lit_scene,
                                       std::span<const SurfacePoint> points,
                                       std::uint32_t samples_per_point, std::uint64_t seed,
                                       const Progress& progress) {
  if (samples_per_point < 1) throw Error("path tracing needs at least one sample per point");
  return Measurement(lit_scene, points, rounded_up(samples_per_point), seed).run(progress);
}

}  // namespace rebounce::reference

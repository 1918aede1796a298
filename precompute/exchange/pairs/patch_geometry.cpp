#include "precompute/exchange/pairs/patch_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/polygon_form_factor.h"

namespace rebounce {
namespace {

// A patch is flat if its normals stay within this angle (in cosine; 2.5 degrees) and its thickness
// within this fraction of its radius.
constexpr double kFlatCosine = 0.999, kFlatThickness = 0.02;

// Pairs with at most this number of pairs of triangles are summed triangle by triangle. The limit
// is higher for near pairs, where sums over parts are coarser.
constexpr std::size_t kFewTrianglePairs = 4, kFewNearTrianglePairs = 64;

// Below this tolerance sums over parts are too coarse. Pairs are then summed triangle by triangle
// if they have at most as many pairs of triangles as pairs of parts.
constexpr double kPartTolerance = 1e-4;
constexpr std::size_t kPartPairs = std::size_t{1} << (2 * PatchGeometry::kPartLevels);

// Sums over 2^level parts of each patch are used while (sum of radii) / distance is below these:
// their error grows with (that / sqrt(2)^level)^2. Measured:
// tests/precompute/exchange/pairs/test_patch_geometry.cpp.
constexpr std::array<double, 4> kPartReach = {0.02, 0.1, 0.4, 0.6};
constexpr std::array<int, 4> kPartLevel = {0, 2, 4, 5};

// A part whose vector area is at least this fraction of its area is about flat: within 45 degrees
// or so.
constexpr double kAboutFlat = 0.85;

// A part nearer than this multiple of the radii of both is summed triangle by triangle.
constexpr double kNearPart = 1.5;

// A triangle this small relative to its distance counts as a point.
constexpr double kPointLike = 0.25;

std::size_t part_offset(int level) {
  return (std::size_t{1} << level) - 1;
}
constexpr std::size_t kPartStride = (std::size_t{2} << PatchGeometry::kPartLevels) - 1;

PatchBounds bounds_of(std::span<const FlatTriangle> triangles) {
  PatchBounds bounds;
  glm::dvec3 low(std::numeric_limits<double>::max()), high = -low, vector_area(0);
  for (const FlatTriangle& t : triangles) {
    vector_area += t.area * t.normal;
    for (const glm::dvec3& v : t.vertex) {
      low = glm::min(low, v);
      high = glm::max(high, v);
    }
  }
  bounds.centre = triangles.size() == 1 ? triangles[0].centroid : 0.5 * (low + high);
  const double length = glm::length(vector_area);
  bounds.axis = length > 0 ? vector_area / length : triangles[0].normal;
  for (const FlatTriangle& t : triangles) {
    bounds.cone_cosine = std::min(bounds.cone_cosine, glm::dot(bounds.axis, t.normal));
    for (const glm::dvec3& v : t.vertex) {
      const glm::dvec3 d = v - bounds.centre;
      bounds.radius = std::max(bounds.radius, glm::length(d));
      if (triangles.size() == 1) continue;
      bounds.thickness = std::max(bounds.thickness, std::abs(glm::dot(bounds.axis, d)));
    }
  }
  bounds.cone_sine = std::sqrt(std::max(0.0, 1 - bounds.cone_cosine * bounds.cone_cosine));
  return bounds;
}

PatchPart whole_of(std::span<const FlatTriangle> triangles) {
  double area = 0, radius = 0;
  glm::dvec3 centroid(0), vector_area(0);
  for (const FlatTriangle& t : triangles) {
    area += t.stopping_area();
    centroid += t.stopping_area() * t.centroid;
    vector_area += t.stopping_area() * t.normal;
  }
  centroid /= area;
  for (const FlatTriangle& t : triangles) {
    for (const glm::dvec3& v : t.vertex) radius = std::max(radius, glm::distance(v, centroid));
  }
  return {centroid, vector_area, static_cast<float>(area), static_cast<float>(radius)};
}

bool is_about_flat(const PatchPart& part) {
  return glm::length(part.vector_area) >= kAboutFlat * part.area;
}

std::array<FlatTriangle, 2> bisect(const FlatTriangle& t) {
  int longest = 0;
  double length = 0;
  for (int k = 0; k < 3; ++k) {
    const double edge = glm::distance(t.vertex[k], t.vertex[(k + 1) % 3]);
    if (edge > length) {
      length = edge;
      longest = k;
    }
  }
  const glm::dvec3 a = t.vertex[longest], b = t.vertex[(longest + 1) % 3],
                   c = t.vertex[(longest + 2) % 3], middle = 0.5 * (a + b);
  std::array<FlatTriangle, 2> halves = {FlatTriangle(a, middle, c), FlatTriangle(middle, b, c)};
  for (FlatTriangle& half : halves) half.stopping_part = t.stopping_part;
  return halves;
}

/// Sorts triangles along the axis in which `vector`(t) spreads most; returns how many of them make
/// up half the area.
template <typename Vector>
std::size_t split_in_half(std::span<FlatTriangle> triangles, const Vector& vector) {
  glm::dvec3 low(std::numeric_limits<double>::max()), high = -low;
  double area = 0;
  for (const FlatTriangle& t : triangles) {
    low = glm::min(low, vector(t));
    high = glm::max(high, vector(t));
    area += t.stopping_area();
  }
  const glm::dvec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::ranges::stable_sort(triangles, {}, [&](const FlatTriangle& t) { return vector(t)[axis]; });
  std::size_t count = 0;
  for (double before = 0; count + 1 < triangles.size() && before < 0.5 * area; ++count) {
    before += triangles[count].stopping_area();
  }
  return std::max<std::size_t>(count, 1);
}

/// Cuts a patch into parts of about equal area, stored as a binary heap: the children of part k are
/// parts 2 k + 1 and 2 k + 2.
class PartWriter {
 public:
  PartWriter(std::span<PatchPart> heap, std::vector<FlatTriangle>& fragment,
             std::vector<std::uint32_t>& begin)
      : heap_(heap), fragment_(fragment), begin_(begin) {
    begin_.push_back(0);
  }

  void write(std::span<FlatTriangle> triangles, int levels_below, std::size_t node) {
    heap_[node] = whole_of(triangles);
    if (levels_below == 0) {
      fragment_.insert(fragment_.end(), triangles.begin(), triangles.end());
      begin_.push_back(static_cast<std::uint32_t>(fragment_.size()));
      return;
    }
    std::array<FlatTriangle, 2> half;
    std::size_t first = 1;
    if (triangles.size() == 1) {
      half = bisect(triangles[0]);
      triangles = half;
    } else {
      // The first cuts are by normals, which matter at any distance.
      first = is_about_flat(heap_[node])
                  ? split_in_half(triangles, [](const FlatTriangle& t) { return t.centroid; })
                  : split_in_half(triangles, [](const FlatTriangle& t) { return t.normal; });
    }
    write(triangles.first(first), levels_below - 1, 2 * node + 1);
    write(triangles.subspan(first), levels_below - 1, 2 * node + 2);
  }

 private:
  std::span<PatchPart> heap_;
  std::vector<FlatTriangle>& fragment_;
  std::vector<std::uint32_t>& begin_;
};

double between_parts(std::span<const PatchPart> a, std::span<const PatchPart> b) {
  double sum = 0;
  for (const PatchPart& x : a) {
    const glm::dvec3 from(x.centroid), area(x.vector_area);
    double inner = 0;
    for (const PatchPart& y : b) {
      inner += point_kernel(from, area, glm::dvec3(y.centroid), glm::dvec3(y.vector_area));
    }
    sum += inner;
  }
  return sum;
}

double between_triangles(std::span<const FlatTriangle> a, std::span<const FlatTriangle> b,
                         double tolerance) {
  double sum = 0;
  for (const FlatTriangle& x : a) {
    for (const FlatTriangle& y : b) {
      sum += x.stopping_part * y.stopping_part * unoccluded_exchange_area(x, y, tolerance);
    }
  }
  return sum;
}

/// The exchange of a part with a triangle per area of the part, which faces `normal`.
double part_to_triangle(const PatchPart& part, const glm::dvec3& normal, const FlatTriangle& t) {
  const glm::dvec3 centroid(part.centroid), d = centroid - t.centroid;
  const double height = glm::dot(t.normal, d);
  if (height <= 1e-6 * t.radius) return 0;
  if (t.radius * t.radius < kPointLike * kPointLike * glm::dot(d, d)) {
    return t.stopping_area() * point_kernel(centroid, normal, t.centroid, t.normal);
  }
  // Coordinates are relative to the part, so that single precision is enough.
  const std::array<glm::vec3, 3> corner = {t.vertex[0] - centroid, t.vertex[1] - centroid,
                                           t.vertex[2] - centroid};
  return t.stopping_part * point_to_polygon_form_factor({0, 0, 0}, normal, corner);
}

/// The exchange of the parts of patch i with patch j: with its parts where they are far for their
/// size, otherwise with its triangles.
double parts_to_patch(const PatchGeometry& geometry, std::size_t i, std::size_t j) {
  constexpr int kFinest = PatchGeometry::kPartLevels;
  const std::span<const PatchPart> to = geometry.parts(j, kFinest);
  double sum = 0;
  for (const PatchPart& from : geometry.parts(i, kFinest)) {
    const glm::dvec3 centroid(from.centroid), vector_area(from.vector_area);
    const double seen_area = glm::length(vector_area);
    if (seen_area <= 0) continue;
    const glm::dvec3 normal = vector_area / seen_area;
    double inner = 0;
    for (std::size_t k = 0; k < to.size(); ++k) {
      const double reach = kNearPart * (from.radius + to[k].radius);
      const glm::dvec3 there(to[k].centroid), d = there - centroid;
      if (glm::dot(d, d) > reach * reach) {
        inner += point_kernel(centroid, normal, there, glm::dvec3(to[k].vector_area));
        continue;
      }
      for (const FlatTriangle& t : geometry.fragments(j, k)) {
        inner += part_to_triangle(from, normal, t);
      }
    }
    sum += seen_area * std::min(inner, 1.0);
  }
  return sum;
}

// The outermost points lie at this fraction of the way from the centroid to a corner of a triangle
// (lab/004).
constexpr double kBesideCorner = 0.94;

/// The points near the corners of all `triangles`.
std::vector<PatchPoint> corner_points(std::span<const FlatTriangle> triangles) {
  std::vector<PatchPoint> points;
  for (const FlatTriangle& t : triangles) {
    for (const glm::dvec3& v : t.vertex) {
      points.push_back({to_float3(glm::mix(t.centroid, v, kBesideCorner)), to_float3(t.normal)});
    }
  }
  return points;
}

/// The point with the largest `measure`(position).
template <typename Measure>
PatchPoint find_farthest(std::span<const PatchPoint> points, const Measure& measure) {
  return *std::ranges::max_element(
      points, {}, [&](const PatchPoint& p) { return measure(to_dvec3(p.position)); });
}

std::array<PatchPoint, 3> find_outermost(std::span<const PatchPoint> points,
                                         const glm::dvec3& centre) {
  const PatchPoint first =
      find_farthest(points, [&](const glm::dvec3& p) { return glm::distance(p, centre); });
  const glm::dvec3 a = to_dvec3(first.position);
  const PatchPoint second =
      find_farthest(points, [&](const glm::dvec3& p) { return glm::distance(p, a); });
  const glm::dvec3 b = to_dvec3(second.position);
  const PatchPoint third = find_farthest(
      points, [&](const glm::dvec3& p) { return glm::length(glm::cross(p - a, p - b)); });
  return {first, second, third};
}

/// The sum of the radii over the distance: large for near pairs.
double relative_reach(const PatchGeometry& geometry, std::size_t i, std::size_t j) {
  const PatchBounds &a = geometry.bounds(i), &b = geometry.bounds(j);
  return (a.radius + b.radius) / glm::distance(a.centre, b.centre);
}

}  // namespace

bool PatchBounds::is_flat() const {
  return cone_cosine >= kFlatCosine && thickness <= kFlatThickness * radius;
}

bool PatchBounds::may_face(const glm::dvec3& point, double sphere_radius) const {
  const glm::dvec3 d = point - centre;
  const double along = glm::dot(axis, d);
  if (along + thickness + sphere_radius > 0 || cone_cosine <= 0) return true;
  if (cone_cosine == 1) return false;
  // The normal of the cone that turns most towards the point.
  const double across = std::sqrt(std::max(0.0, glm::dot(d, d) - along * along));
  return along * cone_cosine + across * cone_sine + radius + sphere_radius > 0;
}

PatchGeometry::PatchGeometry(const PatchModel& model, const RayTracer& tracer)
    : offset_(tracer.offset_distance()) {
  const PatchTriangles patches(model.mesh.triangle_patch, model.patches.size());
  const std::size_t n = patches.patch_count();
  begin_.push_back(0);
  for (std::size_t i = 0; i < n; ++i) {
    for (const std::uint32_t t : patches[i]) {
      const Uint3& v = model.mesh.triangle[t];
      triangle_.emplace_back(to_dvec3(model.mesh.position[v[0]]),
                             to_dvec3(model.mesh.position[v[1]]),
                             to_dvec3(model.mesh.position[v[2]]));
      triangle_.back().stopping_part = model.mesh.opacity.stopping_part(t);
    }
    begin_.push_back(static_cast<std::uint32_t>(triangle_.size()));
  }
  area_.resize(n);
  bounds_.resize(n);
  surface_.resize(n);
  outermost_.resize(n);
  parts_.resize(n * kPartStride);
  fragments_.resize(n);
  flat_level_.resize(n);
  std::size_t most_triangles = 0;
  for (std::size_t i = 0; i < n; ++i) {
    most_triangles = std::max(most_triangles, triangles(i).size());
  }
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t i = 0; i < n; ++i) {
    for (const FlatTriangle& t : triangles(i)) area_[i] += t.stopping_area();
    bounds_[i] = bounds_of(triangles(i));
    surface_[i] = PatchSurface(model.mesh, patches[i]);
    outermost_[i] = find_outermost(corner_points(triangles(i)), bounds_[i].centre);
    for (PatchPoint& p : outermost_[i]) p.position = tracer.offset_point(p.position, p.normal);
    add_parts(i, triangles(i).size() * most_triangles > kFewNearTrianglePairs);
  }
}

void PatchGeometry::add_parts(std::size_t patch, bool with_fragments) {
  const std::span<const FlatTriangle> all = triangles(patch);
  std::vector<FlatTriangle> own(all.begin(), all.end());
  Fragments fragments;
  PartWriter({&parts_[patch * kPartStride], kPartStride}, fragments.triangle, fragments.begin)
      .write(own, kPartLevels, 0);
  if (with_fragments) {
    fragments.triangle.shrink_to_fit();
    fragments_[patch] = std::move(fragments);
  }
  int level = 0;
  while (level < kPartLevels && !std::ranges::all_of(parts(patch, level), is_about_flat)) ++level;
  flat_level_[patch] = static_cast<std::uint8_t>(level);
}

std::span<const PatchPart> PatchGeometry::parts(std::size_t patch, int level) const {
  return {&parts_[patch * kPartStride + part_offset(level)], std::size_t{1} << level};
}

bool is_near_pair(const PatchGeometry& geometry, std::size_t i, std::size_t j) {
  return i == j || !(relative_reach(geometry, i, j) < kPartReach.back());
}

bool is_coarse_pair(const PatchGeometry& geometry, std::size_t i, std::size_t j) {
  return geometry.triangles(i).size() * geometry.triangles(j).size() > kFewNearTrianglePairs &&
         is_near_pair(geometry, i, j);
}

double unoccluded_exchange_area(const PatchGeometry& geometry, std::size_t i, std::size_t j,
                                double tolerance) {
  const std::span<const FlatTriangle> a = geometry.triangles(i), b = geometry.triangles(j);
  const std::size_t few = tolerance < kPartTolerance ? kPartPairs : kFewTrianglePairs;
  if (a.size() * b.size() <= few) return between_triangles(a, b, tolerance);
  const double reach = relative_reach(geometry, i, j);
  for (std::size_t k = 0; i != j && k < kPartReach.size(); ++k) {
    if (!(reach < kPartReach[k])) continue;
    return between_parts(geometry.parts(i, std::max(kPartLevel[k], geometry.flat_level(i))),
                         geometry.parts(j, std::max(kPartLevel[k], geometry.flat_level(j))));
  }
  if (a.size() * b.size() <= kFewNearTrianglePairs) return between_triangles(a, b, tolerance);
  // The smaller patch gives the better estimate: a large part of the other, taken as a point beside
  // it, would exchange all that the whole part has. The fraction is at most one.
  const double own = std::pow(geometry.bounds(i).radius, 2),
               other = std::pow(geometry.bounds(j).radius, 2);
  const double exchange =
      (other * parts_to_patch(geometry, i, j) + own * parts_to_patch(geometry, j, i)) /
      (own + other);
  return std::min({exchange, geometry.area(i), geometry.area(j)});
}

}  // namespace rebounce

#pragma once

// The light of an engine's last frame where it is shown: at vertices, in a lightmap, at light
// probes, in air.
//
// Sizes are those of scene_data(engine.data()): v vertices of the display mesh, p probes. Functions
// of a frame allocate and lock nothing, run where the engine's frames do, with the same bits
// wherever that is, and throw Error if a size is wrong or the transfer file has not what they need.
// Light of probes and surface harmonics is what arrives from patches and sky, lamps apart.

#include <array>
#include <cstddef>
#include <span>

#include "rebounce/scene_data.h"
#include "rebounce/types.h"

namespace rebounce {

class Engine;

/// The harmonics that irradiance has up to degree 5: nine of degree 0 to 2, nine of degree 4. The
/// cosine lobe has no other odd degree than 1.
inline constexpr std::size_t kIrradianceHarmonicCount = 2 * kHarmonicCount;

/// Radiance that arrives at a point, cd/m²: coefficients of those harmonics, each of three
/// channels.
using ProbeLight = std::array<Float3, kIrradianceHarmonicCount>;

/// The first nine of them, for renderers that shade by those.
using QuadraticProbeLight = std::array<Float3, kHarmonicCount>;

/// Radiance that arrives at a surface, cd/m²: coefficients of spherical harmonics of degree 0 and
/// 1, each of three channels.
using SurfaceLight = std::array<Float3, kLinearHarmonicCount>;

/// Writes the indirect irradiance in lx at the vertices [v], at least 0; 0 at those without
/// weights. The weights keep the means of patches, for which some are negative: beside a bright
/// patch a dark one would get less than nothing. Where the file has rows of vertices
/// (--receivers-at), what these add is part of it, here and in the lightmap. One thread at a time
/// then.
void vertex_irradiance(const Engine& engine, std::span<Float3> irradiance);

/// Writes the direct irradiance in lx at the vertices [v] likewise: as smooth as patches are large,
/// for renderers without lamps of their own.
void vertex_direct_irradiance(const Engine& engine, std::span<Float3> irradiance);

/// Writes the light at the vertices [v], for normal maps: see bent_irradiance. It is not clamped,
/// since coefficients are negative too. Needs a file made
/// with --surface-harmonics.
void vertex_light(Engine& engine, std::span<SurfaceLight> light);

/// Writes the indirect irradiance in lx at the texels of the lightmap [height][width], rows from
/// the top, at least 0; 0 in texels that show nothing. Needs a file made with --lightmap.
void lightmap_irradiance(Engine& engine, std::span<Float3> irradiance);

/// Writes the light at the probes [p], or its first nine coefficients. Degree 4 is that of the sky
/// alone, whose light is sharp, and zero where its cells are not known. Probes that are not valid
/// get none.
void probe_light(const Engine& engine, std::span<ProbeLight> light);
void probe_light(const Engine& engine, std::span<QuadraticProbeLight> light);

/// Writes the irradiance in lx at each probe k on surfaces of each of the K unit `normals`:
/// irradiance[k K + normal], [p][K], at least 0. Small bright surfaces in view are sharp, where
/// harmonics blur them.
void probe_irradiance(const Engine& engine, std::span<const Float3> normals,
                      std::span<Float3> irradiance);

/// The light at a point in the air, interpolated between the valid ones of the eight probes around
/// it; outside of their grid, the light at its border. Zero where none of the eight is valid, or if
/// the probes are no grid. It takes the time of the probes around the point. Needs a file made with
/// --probes.
ProbeLight light_in_air(const Engine& engine, const Float3& position);

/// The irradiance there on surfaces of each of the unit `normals`: irradiance [K] in lx.
void irradiance_in_air(const Engine& engine, const Float3& position,
                       std::span<const Float3> normals, std::span<Float3> irradiance);

/// The same as light_in_air, from the light [p] that probe_light wrote: faster for many points of a
/// frame. Zero if `light` has another size.
ProbeLight interpolate_probes(const LightProbes& probes, std::span<const ProbeLight> light,
                              const Float3& position);

/// The irradiance in lx on a surface with unit `normal`, at least 0: R. Ramamoorthi, P. Hanrahan,
/// "An efficient representation for irradiance environment maps", SIGGRAPH 2001.
Float3 probe_irradiance(const ProbeLight& light, const Float3& normal);
Float3 probe_irradiance(const QuadraticProbeLight& light, const Float3& normal);

/// The irradiance in lx on a surface with unit `normal` of the light alone, at least 0.
Float3 surface_irradiance(const SurfaceLight& light, const Float3& normal);

/// What `irradiance`, in lx on a surface with unit `normal`, is where a normal map bends that to
/// the unit vector `bent`: scaled by what the light says of both. `normal` itself leaves it as it
/// is, so that the operator's irradiance, which is exact, stays what flat surfaces show.
Float3 bent_irradiance(const SurfaceLight& light, const Float3& irradiance, const Float3& normal,
                       const Float3& bent);

/// Writes the directions of the texels of an octahedral map of `size` x `size`, u fastest, at their
/// middles, +z in the middle of the map: normals [size x size] for irradiance maps as of
/// Z. Majercik et al., "Dynamic diffuse global illumination with ray-traced irradiance fields",
/// JCGT 8(2), 2019. Throws Error if the size of `normals` is another.
void write_octahedral_normals(std::size_t size, std::span<Float3> normals);

}  // namespace rebounce

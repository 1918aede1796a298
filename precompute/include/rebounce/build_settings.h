#pragma once

// All settings of the offline stage.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rebounce/lights.h"
#include "rebounce/operators.h"
#include "rebounce/types.h"

namespace rebounce {

struct SubdivisionSettings {
  /// Wanted number of patches; 0: patch_size decides. More patches resolve finer light; from pairs
  /// offline memory grows with their square, and time faster.
  std::size_t patch_count = 4096;
  /// The largest length of a patch, metres, >= 0; 0: no limit. With patch_count, what is reached
  /// first ends the subdivision.
  float patch_size = 0;
  /// How much finer patches are where the direct light of the scene's own lamps and emitters
  /// varies: a difference of its root mean square over the scene counts like this number of mean
  /// patch sizes of distance, >= 0. 0: light has no part in it.
  double lamp_weight = 4;  // lab/130
};

struct FormFactorSettings {
  std::uint64_t seed = 1;  ///< of the sample points; every seed gives an equally good F
  /// Shadow rays that each pair of patches gets first, at most 256. If they agree, the pair gets no
  /// more. More rays notice partly hidden pairs more often.
  int probe_rays = 8;
  /// Shadow rays for a pair that is partly hidden, at most 256; a pair that exchanges much light
  /// gets six times as many. More rays make penumbrae smoother and take longer.
  int full_rays = 64;
  /// Rays per patch into its hemisphere, at least 1. They measure the light that escapes and the
  /// exchange of near patches of many triangles, and they find pairs that probe rays misjudge. More
  /// rays improve row sums in open scenes and reduce noise between near patches.
  int hemisphere_rays = 4096;
  /// Relative error that the unoccluded kernel aims at, > 0.
  double kernel_tolerance = 3e-4;
  /// Only for links: the largest error of a link. It is an absolute error, in the Frobenius norm,
  /// of the part of A^1/2 F A^-1/2 that the link stands for. Smaller values give smaller sets and
  /// more links. 0: BuildSettings::exchange_source decides.
  double link_epsilon = 0;
};

/// Error that a link may have at the default tolerance, in proportion to which it grows:
/// notes/concepts/links.md.
inline constexpr double kLinkEpsilon = 1e-4;  // lab/122

/// How exact form factors are, and how long they take.
enum class FormFactorQuality : std::uint8_t {
  kLow,      ///< for a first look: about three times as fast
  kDefault,  ///< view factors agree with closed forms to 0.5 %
  kHigh,     ///< to 0.1 %: about ten times slower
};

struct NamedQuality {
  FormFactorQuality quality;
  const char* name;  ///< on the command line and in Python
};

/// All qualities, from the fastest on.
inline constexpr std::array<NamedQuality, 3> kQualities = {{
    {FormFactorQuality::kLow, "low"},
    {FormFactorQuality::kDefault, "default"},
    {FormFactorQuality::kHigh, "high"},
}};

/// The quality of that name. Throws Error if there is none.
FormFactorQuality quality_named(std::string_view name);

/// `settings` with what a quality decides; seed and links stay.
///
/// | quality | probe_rays | full_rays | hemisphere_rays | kernel_tolerance |
/// |---|---|---|---|---|
/// | low | 4 | 16 | 1024 | 3e-3 |
/// | default | 8 | 64 | 4096 | 3e-4 |
/// | high | 32 | 256 | 65536 | 1e-5 |
FormFactorSettings with_quality(FormFactorQuality quality, FormFactorSettings settings = {});

/// The fewest rays of a probe, and of a patch with surface harmonics.
inline constexpr int kFewestProbeRays = 64, kFewestHarmonicRays = 16;

struct ProbeSettings {
  Uint3 grid{0, 0, 0};  ///< probes along x, y and z; zeros: as many as `spacing` gives
  float spacing = 0;    ///< metres between probes; 0: no probes unless `grid` is set
  /// Rays of each probe, at least 64. The error falls with the number, at best in proportion. The
  /// file and the time of a frame grow until all visible patches are hit.
  int ray_count = 2048;
};

/// The sides that a lightmap may have, texels.
inline constexpr std::uint32_t kSmallestLightmap = 16, kLargestLightmap = 4096;

struct LightmapSettings {
  /// Texels along each side; 0: no lightmap. More texels give sharper light; the file grows by 12
  /// bytes per texel.
  std::uint32_t size = 0;
  /// Texels by which charts continue beyond their edge, at most 64. More padding allows more mip
  /// levels; charts closer to each other share the texels between them.
  std::uint32_t padding = 4;
};

struct SurfaceHarmonicSettings {
  /// Rays of each patch, at least 16; 0: no harmonics. The noise falls with the square root of the
  /// number; a patch has at most as many entries, of 17 or 20 bytes, as rays.
  int ray_count = 0;
  std::uint64_t seed = 1;  ///< of the sample points
};

/// What vertices of the display mesh or texels of the lightmap receive beyond what their patches do
/// (ReceiverRows).
struct ReceiverRowSettings {
  bool at_vertices = true;  ///< whether vertices have rows of their own
  bool at_texels = false;   ///< whether texels have; they need a lightmap
  /// Of vertices: the relative error of what they show without rows from which on these are made;
  /// 0: always. It is that of the light over the whole surface, median over lights, found from a
  /// sample of vertices. There are no rows either where vertices that are small against patches
  /// show less than a quarter of the surface, or where texels have rows.
  double least_error = 0.1;  // lab/135
  /// Rays of each receiver, at least 64. The noise of what receivers show falls with the number;
  /// offline time grows with it.
  int ray_count = 1024;
  /// Relative error of the light, root mean square over lights, that rows may leave; receivers
  /// whose weights err less have none. A smaller one takes more bytes.
  double tolerance = 0.02;
  /// Sets of patches that a group of 64 receivers has at most, from 4 to 1024. A receiver takes 9/8
  /// bytes for each, and 4 more.
  std::uint32_t most_sets = 128;

  bool any() const { return at_vertices || at_texels; }
};

/// The default of BuildSettings::tolerance.
inline constexpr double kDefaultTolerance = 0.005;

/// What the operator is made from.
enum class ExchangeSource : std::uint8_t {
  /// Pairs; for a hierarchical operator links above kPairsPatchCount patches, or where pairs are
  /// over the memory limit.
  kAutomatic,
  kPairs,  ///< all pairs of patches, up to n² / 4 of them, and a dense inverse
  kLinks,  ///< links between sets of patches: nothing grows with n²
};

/// Above this, memory in proportion to n² is not asked for.
inline constexpr std::size_t kPairsPatchCount = 20000;

struct BuildSettings {
  double scale = 1;  ///< metres per unit of the scene file, > 0
  /// The scene's own lamps, in place of those of the asset. Patches are finer where their light
  /// varies, and the operator is fitted to it. The data keep those of KHR_lights_punctual, without
  /// a profile; BuildReport::warnings say how many others there are.
  std::optional<std::vector<Light>> lights;
  SubdivisionSettings subdivision;
  FormFactorSettings form_factors;
  /// kPairs: link_epsilon is 0.
  /// kLinks: link_epsilon 0 stands for kLinkEpsilon, times the tolerance over the default one, and
  /// less where the light of these links is too far off; the operator is hierarchical or none.
  ExchangeSource exchange_source = ExchangeSource::kAutomatic;
  /// Store links too, for hierarchical radiosity: fitted to the form factors of all pairs, or to
  /// the links that were found instead.
  bool store_links = false;
  ProbeSettings probes;                       ///< by default none
  LightmapSettings lightmap;                  ///< by default none
  SurfaceHarmonicSettings surface_harmonics;  ///< by default none
  ReceiverRowSettings receiver_rows;          ///< by default where needed; with an operator alone
  OperatorKind operator_kind = OperatorKind::kHierarchical;
  /// Relative area-weighted L2 error that the indirect light of the hierarchical operator may have,
  /// in the mean over point lights, > 0. Twice the tolerance takes about 0.6 of the bytes.
  double tolerance = kDefaultTolerance;
  std::size_t rank = 256;  ///< of kLowRank: at least 1
  /// By default kF32 for a dense operator, kQ8 for a hierarchical one, kF16 (half the bytes, an
  /// error of some 1e-4) for others.
  std::optional<Precision> precision;
  /// Keep the form factors of all pairs, for iterative solvers, comparisons and export. Not with
  /// kLinks, which has none.
  bool store_form_factors = false;
  /// Error of F B, relative and area-weighted L2, in the mean, at which the form factors are
  /// compressed and kept, for the same uses. A smaller error takes more bytes. 0: they are not
  /// kept; where the operator is made from them (kLinks), they have a fifth of its tolerance, or
  /// less where little light reaches the receivers. Without an operator there are none.
  double form_factor_tolerance = 0;
  /// Whose indirect light is wanted, and what lamps shine on: names of meshes and materials
  /// (mesh:NAME or material:NAME for one kind) and boxes in metres, box:X0,Y0,Z0,X1,Y1,Z1, or none
  /// for all patches. Only what the light of sources does to receivers is compressed, checked and
  /// stored, and from links solved for; light goes by way of all patches nevertheless. What emits
  /// is a source, named or not. The operator is then hierarchical.
  std::vector<std::string> receivers, sources;
  /// Refuses to start what needs more, bytes; 0: half of the machine's memory. With links, a lower
  /// limit means that links are not made finer where finer ones would not fit, and that less of the
  /// operator is made at a time: slower, with the same bits from the same links.
  std::uint64_t memory_limit_bytes = 0;
  /// With kLinks: folder that the links, and what is done of the operator, are kept in, so that a
  /// build that was killed has that done when it is started again with the same scene and settings.
  /// It stays behind. Empty: none.
  std::filesystem::path checkpoint;
};

}  // namespace rebounce

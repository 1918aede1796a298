#pragma once

#include <span>

#include "rebounce/transfer/linked_form_factors.h"

namespace rebounce {

/// The usual error for which links are made coarser, as a part of that to which they were refined:
/// a third of the links stays, and the light is as true as it was (notes/links.md).
inline constexpr double kLinkCoarsening = 0.2;

/// Fewer links for the same patches: two links of one node to both children of another become one
/// link to their parent, again and again, while all that a link has lost since stays below
/// `epsilon`: of the part of the symmetric form A^1/2 F A^-1/2 that it stands for, Frobenius,
/// absolute, as FormFactorSettings::link_epsilon. Refinement splits where it cannot know, and where
/// row sums are doubtful down to patches; this finds out what of it was needed. The kernel of two
/// links is replaced by the affine one of the least squares, so that what nodes exchange and, after
/// scaling again, what each patch gathers of uniform light stay the same.
///
/// `area` [n] in m², `centroid` [n] in metres. The same bits every time. Throws Error if `links`
/// are damaged or `epsilon` is negative or not finite.
FormFactorLinks coarsen_links(const FormFactorLinks& links, std::span<const float> area,
                              std::span<const Float3> centroid, double epsilon);

}  // namespace rebounce

#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "transfer/data/intensity_profile.h"

namespace rebounce {

/// Reads the photometric data of a luminaire from the text of an IES file (ANSI/IES LM-63-1986 to
/// -2019, type C photometry), with multiplier and ballast factor. Keywords and the shape of the
/// lamp are ignored. `name` stands for the file in messages. Throws Error if the text is not such a
/// file, is of type A or B, or has angles that type C does not allow.
std::shared_ptr<const IntensityProfile> parse_ies_profile(std::string_view text,
                                                          const std::string& name);

}  // namespace rebounce

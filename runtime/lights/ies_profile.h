#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "transfer/data/intensity_profile.h"

namespace rebounce {

/// Reads the photometric data of a luminaire from the text of an IES file (ANSI/IES LM-63-1986 to
/// -2019, type C photometry), with its multiplier and ballast factor; keywords and the lamp's shape
/// are skipped. `name` stands for the file in messages. Throws Error if the text is not that, or of
/// type A or B, or its angles are not those of a type C measurement.
std::shared_ptr<const IntensityProfile> parse_ies_profile(std::string_view text,
                                                          const std::string& name);

}  // namespace rebounce

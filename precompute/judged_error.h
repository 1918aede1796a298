#pragma once

#include <span>

namespace rebounce {

/// What the search for the tolerance holds below a part of it: the mean of the errors, or the
/// largest of the first 64 over 3 if that is more. Where there are lights for two such groups at
/// least, also what a group of 64 has as its largest in the median of groups, nearly: the largest
/// error but one for each further group. One light more or less says little of the rest, and this
/// is steadier; it is taken over 2.75. Gates of 0.5 % and 1.5 % over 64 lights are what it is made
/// for. `errors`, >= 0, at least one, in the order in which the lights were drawn. Measured:
/// notes/operator.md.
double judged_error(std::span<const double> errors);

}  // namespace rebounce

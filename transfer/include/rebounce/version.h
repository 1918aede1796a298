#pragma once

namespace rebounce {

/// The version of the project this library was built from, "major.minor.patch".
const char* version();

}  // namespace rebounce
